"""Numbers for people: round-off is written as 0, everything larger as it is."""

from __future__ import annotations

import pytest

from fivebar_pin._arrays import ROUND_OFF, figures, lazy, settled


@pytest.mark.parametrize(
    ("value", "scale", "text"),
    [
        (9.6e-17, 1.2, "0"),
        (-9.6e-17, 1.2, "0"),
        (-0.0, 1.0, "0"),
        (9.6e-17, 0.0, "9.6e-17"),  # nothing cancels: a small number is a number
        (9.6e-17, 1e-16, "9.6e-17"),
        (3.14159, 1.0, "3.142"),
        (1.1 * ROUND_OFF, 1.0, "1e-12"),
        (0.9 * ROUND_OFF, 1.0, "0"),
        (float("nan"), 1.0, "nan"),
        (float("inf"), 1.0, "inf"),
    ],
)
def test_round_off_is_written_as_zero(value: float, scale: float, text: str) -> None:
    assert figures(value, scale) == text


def test_values_keep_every_digit_above_round_off() -> None:
    assert settled(0.1 + 0.2, 1.0) == 0.1 + 0.2
    assert str(settled(-1e-30, 1.0)) == "0.0"


def test_a_lazy_property_is_computed_once_for_each_object_and_shown_by_its_class() -> None:
    class Square:
        """An example."""

        asked = 0

        def __init__(self, side: float) -> None:
            self.side = side

        @lazy
        def area(self) -> float:
            """Area [m2]."""
            self.asked += 1
            return self.side**2

    small, large = Square(2.0), Square(3.0)
    assert (small.area, large.area, small.area, small.asked, large.asked) == (4.0, 9.0, 4.0, 1, 1)
    assert Square.area.__doc__ == "Area [m2]."
