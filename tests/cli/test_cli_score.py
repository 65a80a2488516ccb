"""`fivebar-pin score`: what it prints and writes is what the library scores, and bad files are named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin.balancing import score, variations
from fivebar_pin.balancing.parameters import pseudo_inertia
from fivebar_pin.cli import main


@pytest.fixture
def chain() -> fb.ClosedChain:
    return fb.load(fb.io.shipped_path("five_bar_case_I"))


@pytest.fixture
def motion(tmp_path: Path) -> Path:
    fb.motion.to_file(fb.paper.default_motion(samples=21), tmp_path / "motion.csv", ("psi", "gamma"))
    return tmp_path / "motion.csv"


@pytest.mark.parametrize("kind", ["npy", "csv", "csv with a heading"])
def test_scores_of_designs_from_a_file_are_those_of_the_library(
    kind: str, chain: fb.ClosedChain, motion: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    designs = variations(chain, 7, spread=0.3, seed=3)
    file, out = tmp_path / f"designs.{kind[:3]}", tmp_path / "scores.csv"
    if kind == "npy":
        np.save(file, designs)
    else:
        heading = ",".join(f"p{k}" for k in range(40)) if "heading" in kind else ""
        np.savetxt(file, designs.reshape(7, 40), delimiter=",", fmt="%.17g", header=heading, comments="")
        if not heading:
            file.write_text(file.read_text().lstrip())
    words = ["score", "five_bar_case_I", "--designs", str(file), "--motion", str(motion)]
    assert main([*words, "--terms", "peak_torque", "added_mass", "--best", "2", "--out", str(out)]) == 0
    said = capsys.readouterr()
    expected = score(chain, fb.motion.from_file(motion), designs, terms=("peak_torque", "added_mass"))
    table = np.loadtxt(out, delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[:, 1], expected["peak_torque"], rtol=1e-12)
    np.testing.assert_allclose(table[:, 2], expected["added_mass"], rtol=1e-9, atol=1e-15)
    assert f"{expected['peak_torque'].min():.6g}" in said.out
    assert "7 designs" in said.out and "scoring" not in said.out


def test_random_designs_are_physical_and_scored(chain: fb.ClosedChain, capsys: pytest.CaptureFixture[str]) -> None:
    """Congruence keeps every pseudo-inertia positive semidefinite; the first design is the mechanism as it is."""
    designs = variations(chain, 200, spread=0.9, seed=1)
    assert np.linalg.eigvalsh(pseudo_inertia(designs)).min() > -1e-15
    np.testing.assert_array_equal(designs[0], chain.inertial_parameters)
    assert np.ptp(designs[:, :, 0], axis=0).min() > 0.1 * designs[0, :, 0].max()
    assert main(["score", "five_bar_case_I", "--random", "50", "--seed", "2"]) == 0
    assert "50 designs" in capsys.readouterr().out


def test_bad_requests_are_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    np.save(tmp_path / "narrow.npy", np.zeros((3, 2, 10)))
    (tmp_path / "words.csv").write_text("a,b\nc,d\n")
    (tmp_path / "short.csv").write_text("1,2,3\n")
    (tmp_path / "scores.csv").write_text("")
    for words, expected in (
        (["--designs", str(tmp_path / "none.npy")], "cannot be read"),
        (["--designs", str(tmp_path / "narrow.npy")], "(k, 4, 10)"),
        (["--designs", str(tmp_path / "words.csv")], "cannot be read"),
        (["--designs", str(tmp_path / "short.csv")], "40 are needed"),
        (["--designs", str(tmp_path / "design.txt")], "must end in"),
        (["--random", "0"], "at least 1"),
        (["--random", "3", "--spread", "2"], "between 0 and 0.9"),
        (["--random", "3", "--best", "0"], "--best"),
        (["--random", "3", "--terms", "beauty"], "Unknown term 'beauty'"),
        (["--random", "3", "--out", str(tmp_path / "scores.csv")], "exists already"),
    ):
        assert main(["score", "five_bar_case_I", *words]) == 1, words
        said = capsys.readouterr().err.strip()
        assert expected in said and said.count("\n") == 0, words
