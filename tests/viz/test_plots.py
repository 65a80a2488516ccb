"""Plots: they draw the given numbers, with units, and never replace a file unasked."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin import paper
from fivebar_pin.errors import InvalidInputError, OutputError
from fivebar_pin.viz import plots


@pytest.fixture(scope="module")
def loads() -> dict[str, fb.Loads]:
    motion = paper.default_motion(samples=31)
    found = {}
    for column in ("unbalanced", "balanced"):
        linkage = paper.table_1("I", column)
        chain = linkage.chain()
        trajectory = fb.drive(chain, motion, near=linkage.configuration(*motion.q[0]))
        found[column] = fb.inverse_dynamics(chain, trajectory)
    return found


T = paper.default_motion(samples=31).t


def test_motion_shows_position_velocity_and_acceleration() -> None:
    """Each panel holds the columns of the motion, with the unit on its axis."""
    motion = paper.default_motion(samples=31)
    figure = plots.motion(motion, ("psi", "gamma"))
    for ax, values, unit in zip(figure.axes, (motion.q, motion.v, motion.a), ("rad", "rad/s", "rad/s²"), strict=True):
        assert f"[{unit}]" in ax.get_ylabel()
        for k, line in enumerate(ax.lines):
            assert np.array_equal(line.get_ydata(), values[:, k])
    assert figure.axes[-1].get_xlabel() == "time [s]"


def test_torques_of_all_mechanisms_share_a_panel_per_joint(loads: dict[str, fb.Loads]) -> None:
    """One panel per actuated joint, one curve per mechanism, both named."""
    figure = plots.torques(loads, ("psi", "gamma"), t=T)
    assert [ax.get_ylabel() for ax in figure.axes] == ["torque at psi [N m]", "torque at gamma [N m]"]
    for k, ax in enumerate(figure.axes):
        assert {line.get_label(): line.get_ydata().tolist() for line in ax.lines} == {
            label: one.torque[:, k].tolist() for label, one in loads.items()
        }
    styles = {(line.get_color(), line.get_linestyle()) for line in figure.axes[0].lines}
    assert len(styles) == 2


def test_shaking_leaves_out_components_that_vanish(loads: dict[str, fb.Loads]) -> None:
    """A planar linkage has two components of force and one of moment."""
    figure = plots.shaking(loads, t=T)
    assert [ax.get_ylabel() for ax in figure.axes] == [
        "shaking force x [N]",
        "shaking force y [N]",
        "shaking moment z [N m]",
    ]
    assert np.array_equal(figure.axes[2].lines[1].get_ydata(), loads["balanced"].shaking_moment[:, 2])


def test_com_legend_tells_the_largest_distance_from_the_start(loads: dict[str, fb.Loads]) -> None:
    """The travel is that of the tables, not the diagonal of a box."""
    com = loads["unbalanced"].com
    travel = 1e3 * max(float(np.linalg.norm(x - com[0])) for x in com)
    label = str(plots.com(loads).axes[0].lines[0].get_label())
    assert float(label.split()[-2]) == pytest.approx(travel, rel=6e-3)


def test_a_single_sample_is_a_dot(loads: dict[str, fb.Loads]) -> None:
    """A line through one point would not be seen."""
    one = plots.forces({"a": np.ones((1, 1, 2))}, ("f01",), t=[0.0])
    assert one.axes[0].lines[0].get_marker() == "o"
    assert plots.com(loads).axes[0].lines[0].get_marker() == "None"


def test_com_is_drawn_in_its_plane_in_millimetres(loads: dict[str, fb.Loads]) -> None:
    """The path is drawn over the two axes of largest travel, equally scaled."""
    ax = plots.com(loads).axes[0]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x [mm]", "y [mm]")
    assert ax.get_aspect() == 1.0
    assert ax.lines[0].get_xdata() == pytest.approx(1e3 * loads["unbalanced"].com[:, 0])


def test_forces_are_magnitudes(loads: dict[str, fb.Loads]) -> None:
    """The panel of a joint shows the length of its force vector."""
    vectors = np.random.default_rng(3).normal(size=(31, 5, 2))
    figure = plots.forces({"a": vectors}, ("f01", "f12", "f23", "f34", "f40"), t=T)
    assert figure.axes[3].lines[0].get_ydata() == pytest.approx(np.hypot(*vectors[:, 3].T))
    assert figure.axes[3].get_ylabel() == "|f34| [N]"


def test_global_state_of_pyplot_is_left_alone(loads: dict[str, fb.Loads]) -> None:
    """Figures are made and saved without pyplot."""
    plots.torques(loads, ("psi", "gamma"), t=T)
    assert "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()


def test_save_writes_png_files_and_keeps_what_exists(loads: dict[str, fb.Loads], tmp_path: Path) -> None:
    """If one of the files exists, none is written; with leave to overwrite, all are."""
    figures = {"torques": plots.torques(loads, ("psi", "gamma"), t=T), "com": plots.com(loads)}
    folder = tmp_path / "new" / "plots"
    paths = plots.save({"com": figures["com"]}, folder)
    assert paths == [folder / "com.png"]
    before = paths[0].read_bytes()
    assert before.startswith(b"\x89PNG")
    with pytest.raises(OutputError, match=r"com\.png.*exists"):
        plots.save(figures, folder)
    assert not (folder / "torques.png").exists()
    assert len(plots.save(figures, folder, overwrite=True)) == 2


def test_save_reports_a_folder_it_cannot_make(tmp_path: Path) -> None:
    """A folder whose name is taken by a file is an output error."""
    (tmp_path / "taken").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        plots.save({"motion": plots.motion(paper.default_motion(samples=5), ("a", "b"))}, tmp_path / "taken")


def test_wrong_input_is_named(loads: dict[str, fb.Loads]) -> None:
    """Names and times that do not fit are refused with what would fit."""
    with pytest.raises(InvalidInputError, match="names"):
        plots.motion(paper.default_motion(samples=5), ("psi",))
    with pytest.raises(InvalidInputError, match="torque of unbalanced"):
        plots.torques(loads, ("psi", "gamma"), t=T[:-1])
    with pytest.raises(InvalidInputError, match="at least one"):
        plots.shaking({}, t=T)


def test_a_balanced_mechanism_travels_nowhere_and_its_axis_is_not_blown_up() -> None:
    """Round-off is no travel in the legend and no curve on a magnified axis; the weight shows in the frame's plot."""
    linkage = paper.balance_mass_centres(paper.table_1("I", "balanced")).linkage
    chain, motion = linkage.chain(gravity=(0.0, -9.81, 0.0)), paper.default_motion(samples=31)
    one = {"b": fb.inverse_dynamics(chain, fb.drive(chain, motion, near=linkage.configuration(*motion.q[0])))}
    assert plots.com(one).axes[0].lines[0].get_label() == "b: travel 0 mm"
    shaking, frame = plots.shaking(one, t=T), plots.frame(one, t=T)
    assert [ax.get_ylabel() for ax in shaking.axes] == ["shaking force x [N]", "shaking moment z [N m]"]
    assert shaking.axes[0].get_ylim() == (-1.0, 1.0)
    assert [ax.get_ylabel() for ax in frame.axes] == ["frame force y [N]", "frame moment z [N m]"]
    assert np.array_equal(frame.axes[0].lines[0].get_ydata(), one["b"].frame_force[:, 1])
