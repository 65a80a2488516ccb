"""The recorded scene: what is written, what is refused, and which plane the camera faces."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin import paper, viz
from fivebar_pin.errors import InvalidInputError, OutputError
from fivebar_pin.viz import _geometry, scene
from fivebar_pin.viz._drawing import extent
from fivebar_pin.viz._stage import Stage


@pytest.fixture(scope="module")
def linkage() -> paper.FiveBar:
    return paper.table_1("I", "unbalanced")


@pytest.fixture(scope="module")
def shown(linkage: paper.FiveBar) -> viz.Shown:
    motion = paper.default_motion(samples=21)
    chain = linkage.chain()
    trajectory = fb.drive(chain, motion, near=linkage.configuration(*motion.q[0]))
    return viz.Shown(chain, trajectory, fb.inverse_dynamics(chain, trajectory), "five-bar")


def arm(*axes: str, gravity: tuple[float, float, float] = (0.0, 0.0, 0.0), turn: np.ndarray | None = None) -> pin.Model:
    """Return an open chain of hinges ("x", "y", "z") and slides ("px", ...), 0.3 m apart, turned in the world."""
    joints = {"x": pin.JointModelRX, "y": pin.JointModelRY, "z": pin.JointModelRZ, "px": pin.JointModelPX}
    model, parent = pin.Model(), 0
    model.gravity.linear = np.array(gravity)
    for k, axis in enumerate(axes):
        R = turn if k == 0 and turn is not None else np.eye(3)
        parent = model.addJoint(parent, joints[axis](), pin.SE3(R, np.array([0.3 * (k > 0), 0.1, 0.0])), f"joint{k}")
        model.appendBodyToJoint(parent, pin.Inertia(1.0, np.array([0.1, 0, 0]), 0.01 * np.eye(3)), pin.SE3.Identity())
    return model


def test_importing_the_package_is_cheap() -> None:
    """Neither meshcat nor matplotlib is imported before something is drawn."""
    code = "import sys, fivebar_pin.viz; sys.exit(any(m in sys.modules for m in ('meshcat', 'matplotlib', 'tornado')))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_nothing_is_printed(shown: viz.Shown, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Writing a page is silent."""
    viz.html(tmp_path / "page.html", [shown])
    assert capfd.readouterr() == ("", "")


def test_page_needs_nothing_else(shown: viz.Shown) -> None:
    """The page names no other resource, and forbids itself to load any."""
    text = viz.page([shown])
    head = text[: text.index("<script")]
    assert "connect-src 'none'" in head and "default-src 'none'" in head
    assert "src=" not in head and "href=" not in head


def test_existing_file_is_kept(shown: viz.Shown, tmp_path: Path) -> None:
    """A file that exists is not touched unless overwriting is allowed."""
    path = tmp_path / "page.html"
    path.write_text("mine")
    with pytest.raises(OutputError, match="exists already"):
        viz.html(path, [shown])
    assert path.read_text() == "mine"
    assert viz.html(path, [shown], overwrite=True).read_text().startswith("<!DOCTYPE html>")


def test_unwritable_folder_is_an_output_error(shown: viz.Shown, tmp_path: Path) -> None:
    """A folder that cannot be made is reported with its path."""
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        viz.html(tmp_path / "file" / "page.html", [shown])


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan, np.inf])
def test_speed_must_be_positive(shown: viz.Shown, speed: float) -> None:
    """A speed that is not positive and finite is refused."""
    with pytest.raises(InvalidInputError, match="speed"):
        viz.page([shown], speed=speed)


def test_something_must_be_shown() -> None:
    """An empty scene is refused."""
    with pytest.raises(InvalidInputError, match="at least one mechanism"):
        viz.page([])


def test_trajectory_of_another_chain_is_refused(shown: viz.Shown) -> None:
    """Configurations of the wrong width are named with the shape they should have."""
    other = fb.ClosedChain(arm("z", "z"), (), ("joint0",))
    with pytest.raises(InvalidInputError, match=r"trajectory\.q.*\(21, 2\)"):
        viz.page([viz.Shown(other, shown.trajectory)])


def test_loads_of_another_trajectory_are_refused(shown: viz.Shown) -> None:
    """A shaking force with another number of samples is refused."""
    loads = SimpleNamespace(shaking_force=np.zeros((5, 3)))
    with pytest.raises(InvalidInputError, match="shaking_force"):
        viz.page([viz.Shown(shown.chain, shown.trajectory, loads)])


def test_hostile_words_stay_words(shown: viz.Shown) -> None:
    """Titles and labels cannot end the script or the title they stand in."""
    word = "</script></title><script>alert(1)</script>"
    text = viz.page([viz.Shown(shown.chain, shown.trajectory, label=word)], title=word)
    assert "<script>alert" not in text


@pytest.mark.parametrize("seed", range(5))
def test_plane_of_motion_is_found_however_it_lies(seed: int) -> None:
    """The camera looks along the common axis of the hinges; right, up and normal are orthonormal."""
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    chain = fb.ClosedChain(arm("z", "z", "px", turn=turn), (), ("joint0",))
    view = _geometry.find_view(chain, np.array([0.3, -0.5, 0.1]))
    assert view.planar
    assert abs(view.normal @ turn[:, 2]) == pytest.approx(1.0, abs=1e-12)
    axes = np.array([view.right, view.up, view.normal])
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)


def test_plane_x_y_is_seen_as_on_paper(shown: viz.Shown) -> None:
    """For a linkage in the plane x-y, x points right and y up."""
    view = _geometry.find_view(shown.chain, shown.trajectory.q[0])
    assert view.planar
    assert view.right == pytest.approx([1, 0, 0])
    assert view.up == pytest.approx([0, 1, 0])


def test_gravity_points_down() -> None:
    """Gravity that lies in the plane of motion points down on the screen."""
    chain = fb.ClosedChain(arm("z", "z", gravity=(-9.81, 0.0, 0.0)), (), ("joint0",))
    assert _geometry.find_view(chain, np.zeros(2)).up == pytest.approx([1, 0, 0])


@pytest.mark.parametrize("axes", [("z", "y"), ("z", "x", "px"), ("x", "px")])
def test_spatial_motion_has_no_plane(axes: tuple[str, ...]) -> None:
    """Hinges that are not parallel, or a slide along them, make a mechanism spatial."""
    chain = fb.ClosedChain(arm(*axes), (), ("joint0",))
    assert not _geometry.find_view(chain, np.full(len(axes), 0.4)).planar


def test_poses_are_forward_kinematics(shown: viz.Shown) -> None:
    """The closure frames meet in the poses that are drawn, and the mass centre is that of the loads."""
    poses = _geometry.compute_poses(shown.chain, shown.trajectory)
    model = shown.chain.model
    ends = []
    for name in shown.chain.closures[0].frames:
        frame = model.frames[model.getFrameId(name)]
        ends.append((poses.joints[:, frame.parentJoint] @ frame.placement.homogeneous)[:, :3, 3])
    assert ends[0] == pytest.approx(ends[1], abs=1e-12)
    assert poses.com == pytest.approx(shown.loads.com, abs=1e-14)


def test_missing_mesh_is_drawn_as_a_rod_and_said(shown: viz.Shown) -> None:
    """A visual whose file is not there does not hide its body."""
    chain = fb.ClosedChain(
        arm("z", "z"), (), ("joint0",), visuals=(fb.Visual("universe", "mesh", (1, 1, 1), mesh="no.stl"),)
    )
    assert "1 mesh file not found" in viz.page([viz.Shown.at(chain, [0.1, 0.2])])


def test_long_trajectories_are_thinned_to_what_a_screen_shows(shown: viz.Shown) -> None:
    """A hundred times the samples over the same time add little more than the line of the trace."""
    chain = shown.chain
    still = shown.trajectory

    def sampled(n: int) -> viz.Shown:
        k = np.linspace(0, len(still) - 1, n).astype(int)
        rest = np.zeros((n, 4))
        return viz.Shown(
            chain, fb.Trajectory(np.linspace(0, 1, n), still.q[k], rest, rest, np.zeros((n, 4, 2)), np.zeros(n))
        )

    small, large = len(viz.page([sampled(100)])), len(viz.page([sampled(10_000)]))
    assert large - small < 500_000  # bytes; the line of the trace keeps every sample


@pytest.mark.parametrize("stored", [False, True])
def test_counterweights_are_named_by_their_bodies_in_one_entry(
    linkage: paper.FiveBar, tmp_path: Path, stored: bool
) -> None:
    """They share a colour, so they share an entry; it survives a file, and no link loses its own shape or name."""
    from fivebar_pin import balancing
    from fivebar_pin.viz import _page

    bare = replace(linkage.chain(), visuals=())
    for chain in (linkage.chain(), bare):
        design = fb.balance(chain, "force", bodies=("psi", "theta_psi", "gamma"), region=balancing.Ball(0.1))
        heavier = balancing.realise(design).chain
        if stored:
            fb.save(heavier, tmp_path / f"{len(chain.visuals)}.urdf")
            heavier = fb.load(tmp_path / f"{len(chain.visuals)}.urdf")
        shown = viz.Shown.at(heavier, linkage.configuration(0.3, 1.5))
        legend = [entry["text"] for entry in _page._legend(scene._drawings([shown], 1.0, True))]
        assert legend[:5] == ["link1", "link2", "link3", "link4", "counterweight on link1, link2, link4"]


def test_the_picture_holds_meshes_too_those_of_the_ground_among_them(tmp_path: Path) -> None:
    """A mesh far larger than the arm that carries it, scaled; one that cannot be read has no size."""
    mesh = tmp_path / "block.obj"
    mesh.write_text("v 0 0 0\nv 200 0 0\nv 0 100 0\nv 0 0 300\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n")
    broken = tmp_path / "broken.stl"
    broken.write_text("no mesh")
    assert extent(str(mesh)) == ((0.0, 0.0, 0.0), (200.0, 100.0, 300.0))
    assert extent(str(broken)) == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    for frame in ("universe", "link1"):
        small = fb.ClosedChain(arm("z", "z"), (), ("joint0",))
        frame = frame if frame in {f.name for f in small.model.frames} else small.model.frames[-1].name
        large = replace(small, visuals=(fb.Visual(frame, "mesh", (0.1, 0.1, 0.1), mesh=str(mesh)),))
        boxes = [
            Stage.around(scene._drawings([viz.Shown.at(c, [0.1, 0.2])], 1.0, False)).boxes[0] for c in (small, large)
        ]
        grown = (boxes[1][1] - boxes[1][0]) - (boxes[0][1] - boxes[0][0])
        assert grown.max() > 20.0, frame
    pointer = tmp_path / "pointer.stl"
    pointer.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n")
    chain = replace(small, visuals=(fb.Visual("universe", "mesh", (1, 1, 1), mesh=str(pointer)),))
    assert "1 mesh file not found" in viz.page([viz.Shown.at(chain, [0.1, 0.2])])
