"""What docs/linkages.md says runs as it stands."""

from __future__ import annotations

import re
from pathlib import Path

import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin.shipped import TreeBuilder

TEXT = (Path(__file__).resolve().parents[2] / "docs" / "linkages.md").read_text(encoding="utf-8")


def blocks(text: str, word: str) -> list[str]:
    return re.findall(rf"^```{word}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def test_the_python_runs_and_the_file_is_the_same_linkage(tmp_path: Path) -> None:
    known: dict[str, object] = {"__name__": "linkages"}
    for block in blocks(TEXT, "python"):
        exec(compile(block, "linkages.md", "exec"), known)
    chain = known["chain"]
    assert known["design"].feasible and known["design"].after["rms_shaking_force"] < 1e-9
    (text,) = blocks(TEXT, "yaml")
    path = tmp_path / "four.yaml"
    path.write_text(text)
    assert fb.load(path).model == chain.model


@pytest.mark.parametrize("kind", [fb.planar.Linkage, TreeBuilder], ids=lambda kind: kind.__name__)
def test_the_example_of_a_docstring_runs(kind: type) -> None:
    lines = re.findall(r"^        (?!    )(\w.*)$", kind.__doc__ or "", re.MULTILINE)
    known: dict[str, object] = {kind.__name__: kind, "pin": pin}
    exec("\n".join(lines), known)
    assert fb.diagnose(known["chain"]).mobility == 1
