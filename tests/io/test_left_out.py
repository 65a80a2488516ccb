"""What a file states and the mechanism goes without is told in one line."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

from fivebar_pin.errors import LeftOutWarning
from fivebar_pin.io._left_out import left_out


def test_equal_things_are_counted_in_one_line() -> None:
    with pytest.warns(LeftOutWarning) as caught:
        left_out(Path("arm.xml"), ["sensor", "camera", "sensor", "texture 'wood'"])
    (one,) = caught
    assert str(one.message) == ("arm.xml: left out: 2 sensors, camera, texture 'wood'")


def test_nothing_left_out_is_not_told() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        left_out(Path("arm.xml"), [])
