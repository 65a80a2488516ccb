"""What MuJoCo's compiler does to masses, and the words that it knows."""

from __future__ import annotations

from pathlib import Path

import pytest

import fivebar_pin as fb
from fivebar_pin.errors import LeftOutWarning
from fivebar_pin.io._mjcf_attributes import DRIVES, KNOWN

mujoco = pytest.importorskip("mujoco")
from mujoco_twin import Twin  # noqa: E402

HEAVY = """<mujoco><compiler {}/><option><flag {}/></option><worldbody>
<body name="a"><joint name="ja" axis="1 2 0"/><inertial mass="0.5" pos="0.1 0.2 0" {} quat="1 2 3 4"/>
<geom size="0.1" group="1"/><geom type="box" size="0.1 0.2 0.3" pos="0.3 0 0" group="3"/>
<body name="b" pos="0 0 0.4"><joint name="jb" axis="0 1 0"/><geom type="capsule" size="0.01 0.1" group="2"/>
<body name="bare" pos="0.1 0 0.4"/></body></body></worldbody></mujoco>"""


@pytest.mark.parametrize(
    "compiler",
    [
        "",
        'inertiafromgeom="true"',
        'inertiafromgeom="true" inertiagrouprange="1 2"',
        'inertiafromgeom="true" inertiagrouprange="3 3" boundmass="0.2" boundinertia="0.01"',
        'boundmass="0.3" boundinertia="0.004"',
        'inertiafromgeom="true" inertiagrouprange="2 2"',
        'settotalmass="7"',
        'settotalmass="7" boundmass="0.2"',
        'balanceinertia="true"',
    ],
)
def test_masses_are_adjusted_as_mujoco_adjusts_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, compiler: str
) -> None:
    """Bounds, balance and total, of bodies without a joint or a mass too."""
    monkeypatch.chdir(tmp_path)  # MuJoCo writes a log where it stands, as it means to give settotalmass up
    moments = "0.01 0.02 0.2" if "balance" in compiler else "0.011 0.012 0.013"
    path = tmp_path / "m.xml"
    path.write_text(HEAVY.format(compiler, "", f'diaginertia="{moments}"'))
    Twin(path).assert_same()


def test_gravity_that_is_off_does_not_pull(tmp_path: Path) -> None:
    path = tmp_path / "m.xml"
    path.write_text(HEAVY.format("", 'gravity="disable"', 'diaginertia="0.011 0.012 0.013"'))
    assert not fb.load(path).model.gravity.linear.any()
    Twin(path).assert_same()


def test_everything_that_does_not_move_the_mechanism_is_told(tmp_path: Path) -> None:
    (tmp_path / "m.xml").write_text(
        '<mujoco><option density="1.2" viscosity="0.1" wind="0 0 0"/><asset><texture type="2d" builtin="flat" name="t" '
        'width="8" height="8"/><hfield name="h" nrow="2" ncol="2" size="1 1 1 1"/></asset><worldbody><light/><camera/>'
        '<light/><geom type="plane" size="1 1 1"/><geom type="hfield" hfield="h"/><body name="m" mocap="true">'
        '<geom type="ellipsoid" size="0.1 0.2 0.3"/></body><body name="a" gravcomp="1"><joint/>'
        '<geom size="0.1"/></body></worldbody><contact><exclude body1="a" body2="m"/></contact>'
        "<sensor><clock/><clock/></sensor>"
        '<custom><numeric name="n" data="1"/><text name="t" data="x"/></custom></mujoco>'
    )
    mujoco.MjModel.from_xml_path(str(tmp_path / "m.xml"))
    with pytest.warns(LeftOutWarning) as caught:
        fb.load(tmp_path / "m.xml")
    assert str(caught[0].message).split("left out: ")[1] == (
        "height field asset, texture, contact exclusion, 2 sensors, density and viscosity of the fluid around it, "
        "2 lights, camera, plane, height field, mocap of body 'm', which stays where it is, ellipsoid shape, "
        "gravcomp of 1 bodies, which are of full weight here, 2 custom values"
    )


def test_every_attribute_that_mujoco_takes_is_known() -> None:
    """MuJoCo prints its own schema: an element, how often it may come, and its attributes."""
    schema: dict[str, set[str]] = {}
    path: list[str] = []
    for line in mujoco.mj_printSchema(False, True).splitlines():
        head, words = line[:27], line[27:].split()
        if head.strip():
            path = [*path[: (len(head) - len(head.lstrip())) // 3], head.split()[0]]
        schema.setdefault("/".join(path), set()).update(words)
    body = "mujoco/(world)body"
    where = {
        "body": body, "inertial": f"{body}/inertial", "joint": f"{body}/joint", "freejoint": f"{body}/freejoint",
        "geom": f"{body}/geom", "site": f"{body}/site", "mesh": "mujoco/asset/mesh",
        "material": "mujoco/asset/material", "compiler": "mujoco/compiler", "connect": "mujoco/equality/connect",
        "weld": "mujoco/equality/weld", "joint_equality": "mujoco/equality/joint",
        "tendon_equality": "mujoco/equality/tendon",
    }  # fmt: skip
    for tag, place in where.items():
        assert schema[place] <= set(KNOWN[tag]), (tag, schema[place] - set(KNOWN[tag]))
    for tag in ("fixed", "spatial"):
        assert schema[f"mujoco/tendon/{tag}"] <= set(KNOWN["tendon"])
    actuators = {
        place.split("/")[2]: words for place, words in schema.items() if place.count("/") == 2 and "/actuator/" in place
    }
    assert set(actuators) <= set(DRIVES)
    assert set().union(*actuators.values()) <= set(KNOWN["actuator"])
