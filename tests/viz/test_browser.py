"""The page in a real browser: an unbalanced and a balanced linkage side by side."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import Window, chromium

import fivebar_pin as fb
from fivebar_pin import paper, viz
from fivebar_pin.viz._drawing import COLOURS

pytestmark = pytest.mark.browser

SPEED = 0.5


def balanced_case_I() -> paper.FiveBar:
    """Return the exact optimum for the printed masses of case I: its mass centre does not move."""
    given = paper.table_1("I", "balanced")
    rho = (-406 / 277, 161 / 277, 438 / 277, 2087 / 554)
    return paper.FiveBar(given.lengths, given.masses, given.inertias, rho, np.zeros(4))


@pytest.fixture(scope="module")
def pair() -> list[viz.Shown]:
    motion = paper.default_motion(samples=41)
    shown = []
    for label, linkage in (("unbalanced", paper.table_1("I", "unbalanced")), ("balanced", balanced_case_I())):
        chain = linkage.chain()
        trajectory = fb.drive(chain, motion, near=linkage.configuration(*motion.q[0]))
        shown.append(viz.Shown(chain, trajectory, fb.inverse_dynamics(chain, trajectory), label))
    return shown


@pytest.fixture(scope="module")
def browser() -> Iterator[Window]:
    with chromium() as window:
        yield window


@pytest.fixture(scope="module")
def address(pair: list[viz.Shown], tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("page") / "pair.html"
    return viz.html(path, pair, speed=SPEED, title="Five-bar, case I").as_uri()


@pytest.fixture
def window(browser: Window, address: str) -> Window:
    """The page of the pair, opened anew only where another test has left it."""
    if browser.page.url != address:
        browser.open(address)
    return browser


def test_page_loads_without_errors_or_network(window: Window) -> None:
    """The browser reports no error, and nothing but the file itself is asked for."""
    assert window.errors == []
    assert window.blocked == []
    assert window.page.title() == "Five-bar, case I"


def test_scene_holds_links_joints_closures_and_mass_centres(window: Window, pair: list[viz.Shown]) -> None:
    """Every link of both linkages is in the scene, with its joint, its mass centre and the closure marks."""
    nodes = set(window.nodes())
    for shown in pair:
        root = f"/mechanisms/{shown.label}"
        for link in ("link1", "link2", "link3", "link4"):
            assert {f"{root}/{link}/joint", f"{root}/{link}/com/dot"} <= nodes
            assert any(node.startswith(f"{root}/{link}/visual ") and node.endswith("/shape/shaft") for node in nodes)
        assert {f"{root}/link2/closure O3 1", f"{root}/link3/closure O3 2", f"{root}/com/ball"} <= nodes
        assert {f"{root}/ground/foot 0", f"{root}/ground/foot 1", f"{root}/force/shaft/rod"} <= nodes


def test_trace_of_the_balanced_linkage_is_a_point(window: Window, pair: list[viz.Shown]) -> None:
    """The line through the total mass centres has no extent when balanced, and that of the loads when not."""
    lines = {s.label: np.array(window.line(f"/mechanisms/{s.label}/trace/line")) for s in pair}
    for shown in pair:
        assert lines[shown.label] == pytest.approx(shown.loads.com, abs=1e-8)  # single precision in the page
    assert np.max(np.ptp(lines["balanced"], axis=0)) < 1e-8
    assert np.max(np.ptp(lines["unbalanced"], axis=0)) > 0.03


@pytest.mark.parametrize("sample", [0, 9, 17, 33])
def test_page_moves_as_the_trajectory(window: Window, pair: list[viz.Shown], sample: int) -> None:
    """At the playing time of a sample, loops are closed in the page and joints are where they should be."""
    shown = pair[0]
    window.at(shown.trajectory.t[sample] / SPEED)
    root = "/mechanisms/unbalanced"
    a, b = (window.world(f"{root}/{end}") for end in ("link2/closure O3 1", "link3/closure O3 2"))
    assert a == pytest.approx(b, abs=1e-5)
    psi = shown.trajectory.q[sample, shown.chain.actuated_index[0]]
    assert window.place(f"{root}/link2") == pytest.approx([0.02 * np.cos(psi), 0.02 * np.sin(psi), 0.0], abs=1e-6)
    assert window.place(f"{root}/com") == pytest.approx(shown.loads.com[sample], abs=1e-6)


def test_arrow_points_along_the_shaking_force_at_one_scale(window: Window, pair: list[viz.Shown]) -> None:
    """Tail to head is the force times one number for all samples and mechanisms; balanced: no arrow to see."""
    shown, scales = pair[0], []
    for sample in (5, 15, 25):
        window.at(shown.trajectory.t[sample] / SPEED)
        tail, head = (np.array(window.world(f"/mechanisms/unbalanced/force{x}")) for x in ("", "/head"))
        force = shown.loads.shaking_force[sample]
        step = head - tail
        # The stage shows x to the right and y up: the first two axes of the screen.
        assert np.cross(step, force) == pytest.approx(np.zeros(3), abs=1e-5)
        scales.append(step @ force / (force @ force))
        still, tip = (np.array(window.world(f"/mechanisms/balanced/force{x}")) for x in ("", "/head"))
        assert np.linalg.norm(tip - still) < 1e-6
    assert scales == pytest.approx([scales[0]] * 3, rel=1e-4)
    assert scales[0] > 0.0


def test_animation_runs_by_itself(window: Window) -> None:
    """Without a touch the links turn, and after the end of the motion they go on from its start."""
    window.page.evaluate("() => { animator.reset(); animator.play(); }")
    before = window.place("/mechanisms/unbalanced/com")
    window.until("animator.time > 0.4")
    assert np.linalg.norm(np.subtract(window.place("/mechanisms/unbalanced/com"), before)) > 1e-3
    window.until("animator.time > 1.2")
    window.until("animator.playing && animator.time < 1.0")


def test_pause_and_slider_rule_the_time(window: Window, pair: list[viz.Shown]) -> None:
    """The button halts the motion, the slider sets the time, and the clock tells it."""
    window.page.evaluate("() => { animator.reset(); animator.play(); }")
    window.page.click("#play")
    assert not window.page.evaluate("animator.playing")
    window.page.evaluate("() => { seek.value = 1.0; seek.dispatchEvent(new Event('input')); }")
    window.until("clock.textContent.startsWith('t = 0.500 s of 1.000 s')")
    assert window.place("/mechanisms/unbalanced/com") == pytest.approx(pair[0].loads.com[20], abs=1e-6)


def test_everything_is_in_the_picture_and_apart(window: Window, pair: list[viz.Shown]) -> None:
    """All joints and mass centres are inside of the canvas, the unbalanced linkage left of the balanced one."""
    parts = ("link1", "link2", "link3", "link4", "link1/com/dot", "link4/com/dot", "com", "force/head")
    project = """paths => paths.map(p => {
      const node = viewer.scene_tree.find(p.split('/').filter((x) => x)).object;
      const v = node.getWorldPosition(new MeshCat.THREE.Vector3()).project(viewer.camera); return [v.x, v.y]; })"""
    spans = {shown.label: [np.inf, -np.inf] for shown in pair}
    for time in np.linspace(0.0, 2.0, 9):
        window.at(float(time))
        for label, span in spans.items():
            seen = np.array(window.page.evaluate(project, [f"/mechanisms/{label}/{part}" for part in parts]))
            assert np.max(np.abs(seen)) < 1.0
            span[:] = min(span[0], seen[:, 0].min()), max(span[1], seen[:, 0].max())
    assert spans["unbalanced"][1] < spans["balanced"][0]


def test_picture_shows_the_colours_of_the_links(window: Window, pair: list[viz.Shown]) -> None:
    """Links, trace and closure are to be seen in the picture itself, in their colours."""
    from matplotlib.colors import rgb_to_hsv
    from PIL import Image

    window.at(0.7)
    box = window.page.locator("#pane").bounding_box()
    picture = Image.open(io.BytesIO(window.page.screenshot(clip=box))).convert("RGB")
    hsv = rgb_to_hsv(np.asarray(picture) / 255.0)
    strong = hsv[hsv[..., 1] > 0.4]
    colours = {v.frame: v.rgba[:3] for v in pair[0].chain.visuals if v.shape == "capsule"}
    colours |= {"com": COLOURS["com"][:3], "closure": COLOURS["closure"][:3]}
    for name, rgb in colours.items():
        hue = rgb_to_hsv(np.array(rgb))[0]
        distance = np.abs((strong[:, 0] - hue + 0.5) % 1.0 - 0.5)
        assert np.count_nonzero(distance < 0.02) > 60, name


def test_words_explain_the_picture(window: Window) -> None:
    """The page names the links, says what the arrow is and how long, and writes the force below each linkage."""
    legend = window.page.inner_text("#legend")
    for word in ("link1", "link4", "loop closure", "ground", "total mass centre", "shaking force on the frame"):
        assert word in legend
    assert "arrow of one grid cell" in window.page.inner_text("#notes")
    window.until("document.querySelectorAll('.label').length === 2")
    labels = window.page.locator(".label").all_inner_texts()
    assert labels[0].startswith("unbalanced") and labels[1].startswith("balanced")
    assert "peak" in labels[0]


def test_hostile_label_is_text_and_odd_names_are_drawn(browser: Window, pair: list[viz.Shown], tmp_path: Path) -> None:
    """A label with markup and slashes is shown as it is, and runs nothing."""
    word = "a/b</script><script>window.hacked = 1</script>"
    path = viz.html(tmp_path / "odd.html", [viz.Shown(pair[0].chain, pair[0].trajectory, label=word)], title=word)
    browser.open(path.as_uri())
    assert browser.page.evaluate("window.hacked") is None
    assert browser.page.inner_text(".label b") == word
    assert browser.page.title() == word
    assert browser.errors == []


def test_still_pose_has_no_player(browser: Window, pair: list[viz.Shown], tmp_path: Path) -> None:
    """A single configuration is shown in its pose, without buttons."""
    chain, q = pair[0].chain, pair[0].trajectory.q[7]
    browser.open(viz.html(tmp_path / "still.html", [viz.Shown.at(chain, q, label="still")]).as_uri())
    assert not browser.page.is_visible("#player")
    a, b = (browser.world(f"/mechanisms/still/{end}") for end in ("link2/closure O3 1", "link3/closure O3 2"))
    assert a == pytest.approx(b, abs=1e-5)
    assert browser.errors == []


def test_shapes_of_all_kinds_are_drawn(browser: Window, pair: list[viz.Shown], tmp_path: Path) -> None:
    """Meshes and every shape a chain may carry reach the page, in their colours and at their places."""
    corners = struct.pack("<9f", 0, 0, 0, 0.02, 0, 0, 0, 0.02, 0)
    (tmp_path / "a.stl").write_bytes(bytes(80) + struct.pack("<I3f", 1, 0, 0, 1) + corners + bytes(2))
    (tmp_path / "b.obj").write_text("v 0 0 0\nv 0.02 0 0\nv 0 0.02 0\nf 1 2 3\n")
    placement = np.eye(4)
    placement[:3, 3] = (0.01, 0.02, 0.0)
    sizes = {"box": (0.01, 0.02, 0.01), "cylinder": (0.01, 0.02), "capsule": (0.01, 0.02), "sphere": (0.01,)}
    visuals = [fb.Visual("link1", shape, size, placement, (1, 0, 0, 1)) for shape, size in sizes.items()]
    visuals += [fb.Visual("link4", "mesh", (1, 1, 1), placement, mesh=str(tmp_path / f)) for f in ("a.stl", "b.obj")]
    chain = replace(pair[0].chain, visuals=tuple(visuals))
    browser.open(viz.html(tmp_path / "shapes.html", [viz.Shown.at(chain, pair[0].trajectory.q[0], label="s")]).as_uri())
    for number, body in enumerate(("link1",) * 4 + ("link4",) * 2):
        node = f"/mechanisms/s/{body}/visual {number}/shape"
        drawn = browser.line(node + ("/shaft" if visuals[number].shape == "capsule" else ""))
        assert np.ptp(np.array(drawn), axis=0).max() == pytest.approx(0.02, rel=1e-3)
        assert browser.place(node + ("/shaft" if visuals[number].shape == "capsule" else "")) == pytest.approx(
            [0.01, 0.02, 0.0]
        )
    assert {"/mechanisms/s/link2/link/0", "/mechanisms/s/link3/link/0"} <= set(browser.nodes())
    assert "/mechanisms/s/link1/link" not in browser.nodes()
    assert browser.errors == []


def test_live_page_follows_the_server(browser: Window, pair: list[viz.Shown]) -> None:
    """The served page shows the scene, and a new one when the server is given it."""
    with viz.serve(pair[:1]) as server:
        browser.open(server.url)
        assert "/mechanisms/unbalanced/link1" in browser.nodes()
        browser.page.wait_for_timeout(1200)  # one round of asking for news
        server.show(pair[1:])
        browser.until("document.querySelector('.label b')?.textContent === 'balanced'")
        assert browser.errors == []
        browser.page.goto("about:blank")


def test_the_frame_force_is_told_beside_the_shaking_force_where_gravity_acts(
    browser: Window, tmp_path: Path, pair: list[viz.Shown]
) -> None:
    """A balanced linkage under gravity: 0 N shake it, the frame carries the weight; without gravity one line."""
    linkage, motion = balanced_case_I(), paper.default_motion(samples=11)
    chain = linkage.chain(gravity=(0.0, -9.81, 0.0))
    trajectory = fb.drive(chain, motion, near=linkage.configuration(*motion.q[0]))
    heavy = viz.Shown(chain, trajectory, fb.inverse_dynamics(chain, trajectory), "heavy")
    browser.open(viz.html(tmp_path / "heavy.html", [heavy]).as_uri())
    browser.until("document.querySelector('.label span').textContent !== ''")
    text = "() => document.querySelector('.label span').textContent"
    weight = 9.81 * chain.mass
    assert browser.page.evaluate(text).split("\n") == [
        "shaking force 0.00 N, peak 0.00 N",
        f"frame force {weight:.2f} N, peak {weight:.2f} N",
    ]
    browser.open(viz.html(tmp_path / "light.html", pair[:1]).as_uri())
    browser.until("document.querySelector('.label span').textContent !== ''")
    assert browser.page.evaluate(text).count("force") == 1
