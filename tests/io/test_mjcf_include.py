"""MJCF files that include others: what MuJoCo makes one model of is one mechanism for us."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin.errors import FileFormatError
from fivebar_pin.io import _mjcf_include
from fivebar_pin.io._load import mechanism_file

mujoco = pytest.importorskip("mujoco")

BODY = '<body name="{0}"><joint name="j{0}" axis="0 1 0"/><geom size="0.1" density="{1}"/></body>'


def write(folder: Path, **files: str) -> Path:
    """Write files, `__` in a name standing for a folder; return main.xml."""
    for name, text in files.items():
        path = folder / (name.replace("__", "/") + ".xml")
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    return folder / "main.xml"


def same_as_mujoco(path: Path) -> fb.ClosedChain:
    """Load a file and compare joints and masses with MuJoCo's."""
    chain, m = fb.load(path), mujoco.MjModel.from_xml_path(str(path))
    assert chain.joints == tuple(m.joint(j).name for j in range(m.njnt))
    masses = m.body_mass[[m.joint(j).bodyid[0] for j in range(m.njnt)]]
    np.testing.assert_allclose([inertia.mass for inertia in list(chain.model.inertias)[1:]], masses, rtol=1e-14)
    return chain


def test_an_included_file_stands_where_it_is_included(tmp_path: Path) -> None:
    """Whatever its root is called, at the top and inside a body, in the order of the file."""
    path = write(
        tmp_path,
        main='<mujoco><worldbody><body name="o"><joint name="jo"/><geom size="0.2"/><include file="a.xml"/>'
        + BODY.format("q", 30)
        + '</body></worldbody><include file="b.xml"/></mujoco>',
        a="<anything>" + BODY.format("x", 10) + BODY.format("y", 20) + "</anything>",
        b='<mujoco model="b"><worldbody>' + BODY.format("z", 40) + "</worldbody></mujoco>",
    )
    assert same_as_mujoco(path).joints == ("jo", "jx", "jy", "jq", "jz")


@pytest.mark.parametrize("beside", [True, False])
def test_a_name_is_looked_up_beside_the_first_file_and_then_beside_the_including_one(
    tmp_path: Path, beside: bool
) -> None:
    files = {
        "main": '<mujoco><include file="sub/a.xml"/></mujoco>',
        "sub__a": '<mujoco><include file="b.xml"/></mujoco>',
        "sub__b": "<mujoco><worldbody>" + BODY.format("sub", 10) + "</worldbody></mujoco>",
    }
    if not beside:
        files["b"] = "<mujoco><worldbody>" + BODY.format("main", 10) + "</worldbody></mujoco>"
    assert same_as_mujoco(write(tmp_path, **files)).joints == ("jsub" if beside else "jmain",)


def test_sections_and_defaults_of_several_files_merge(tmp_path: Path) -> None:
    """The last word of the compiler holds everywhere; a second <default> adds to the main class alone."""
    path = write(
        tmp_path,
        main='<mujoco><compiler angle="radian"/><default><geom density="10"/><default class="c"><geom size="0.2"/>'
        '</default></default><include file="a.xml"/><worldbody><body name="p"><joint name="jp" ref="45"/>'
        '<geom size="0.1"/></body><body name="r"><joint name="jr"/><geom class="c"/></body></worldbody></mujoco>',
        a='<mujoco><compiler angle="degree"/><default><joint armature="0.5"/><geom density="20"/></default></mujoco>',
    )
    chain = same_as_mujoco(path)
    m = mujoco.MjModel.from_xml_path(str(path))
    np.testing.assert_allclose(chain.references["qpos0"], m.qpos0, rtol=1e-15)
    assert m.qpos0[0] == pytest.approx(np.pi / 4.0)
    np.testing.assert_array_equal(chain.model.armature, m.dof_armature)


TWICE = '<m><include file="b.xml"/><include file="./b.xml"/></m>'
NO_AXIS = '<m><worldbody><body name="x"><joint name="k" axis="0 0 0"/><geom size="1"/></body></worldbody></m>'


@pytest.mark.parametrize(
    ("files", "file", "message"),
    [
        ({}, "main.xml", "there is no file 'a.xml'"),
        ({"a": '<m><include file="main.xml"/></m>'}, "a.xml", r"\(main.xml -> a.xml -> main.xml\); break the circle"),
        ({"a": '<m><include file="a.xml"/></m>'}, "a.xml", r"\(main.xml -> a.xml -> a.xml\)"),
        ({"a": TWICE, "b": "<m><size/></m>"}, "a.xml", "a file comes once"),
        ({"a": f'<m><include file="{"x" * 300}"/></m>'}, "a.xml", "there is no file 'xxx"),
        ({"a": "<m/>"}, "a.xml", "is included by main.xml and has nothing in it"),
        ({"a": "<m><include/></m>"}, "a.xml", "<include> needs the attribute 'file'"),
        ({"a": '<m><include file="b.xml"><size/></include></m>'}, "a.xml", "and has no content"),
        ({"a": "<m>"}, "a.xml", "is not well-formed XML"),
        ({"a": NO_AXIS}, "a.xml", "joint 'k': axis"),
    ],
)
def test_what_is_wrong_with_an_included_file_is_told_of_that_file(
    tmp_path: Path, files: dict[str, str], file: str, message: str
) -> None:
    path = write(tmp_path, main='<mujoco><include file="a.xml"/></mujoco>', **files)
    with pytest.raises(FileFormatError, match=message) as caught:
        fb.load(path)
    assert Path(caught.value.path).name == file
    with pytest.raises(ValueError):
        mujoco.MjModel.from_xml_path(str(path))


def test_bounds_hold_for_all_files_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    body = "<mujoco><worldbody>" + BODY.format("x", 10) + "</worldbody></mujoco>"
    path = write(tmp_path, main='<mujoco><include file="a.xml"/></mujoco>', a=body)
    size = path.stat().st_size + (tmp_path / "a.xml").stat().st_size
    assert fb.load(path, max_bytes=size).joints == ("jx",)
    with pytest.raises(FileFormatError, match=f"comes with its included files to more than {size - 1} bytes"):
        fb.load(path, max_bytes=size - 1)
    monkeypatch.setattr(_mjcf_include, "MAX_ELEMENTS", 6)
    with pytest.raises(FileFormatError, match=r"more than .* or 6 elements"):
        fb.load(path)
    monkeypatch.setattr(_mjcf_include, "MAX_DEPTH", 1)
    monkeypatch.setattr(_mjcf_include, "MAX_ELEMENTS", 100)
    with pytest.raises(FileFormatError, match="nested deeper than 1"):
        fb.load(path)


ROBOT = "<mujoco><worldbody>" + BODY.format("x", 10) + "</worldbody><actuator/></mujoco>"
SCENE = '<mujoco><include file="arm.xml"/><worldbody><geom type="plane"/></worldbody></mujoco>'
OF_PARTS = '<mujoco><include file="m.xml"/><worldbody/><equality/></mujoco>'


@pytest.mark.parametrize(
    ("files", "taken"),
    [
        ({"arm": ROBOT, "scene": SCENE}, "arm.xml"),
        ({"arm": ROBOT, "scene": SCENE, "package": "<package/>"}, "arm.xml"),
        ({"arm": OF_PARTS, "m": "<mujoco><worldbody/></mujoco>"}, "arm.xml"),
        ({"arm": ROBOT, "motors": '<mujoco><include file="arm.xml"/><actuator/></mujoco>'}, "motors.xml"),
        ({"arm": ROBOT, "keys": "<mujoco><keyframe/></mujoco>"}, "arm.xml"),
        ({"arm": ROBOT, "robot": ROBOT}, "robot.xml"),
    ],
)
def test_of_a_folder_the_mechanism_is_taken_not_its_scene_or_its_parts(
    tmp_path: Path, files: dict[str, str], taken: str
) -> None:
    write(tmp_path, **files)
    assert mechanism_file(tmp_path).name == taken


def test_a_folder_of_two_mechanisms_asks_which(tmp_path: Path) -> None:
    write(tmp_path, left=ROBOT, right=ROBOT, scene=SCENE.replace("arm", "left"))
    with pytest.raises(FileFormatError, match=r"holds 2 .xml files \(left.xml, right.xml\); name the one to load"):
        mechanism_file(tmp_path)
