"""The mechanisms that ship: their files are what the writer makes, they are closed, and they move as they should."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from random_chains import assert_same, mass_matrix

from fivebar_pin import io, kinematics
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import FileFormatError, UnknownNameError
from fivebar_pin.shipped import mechanisms

MOBILITY = {"delta": 3, "five_bar_case_I": 2, "five_bar_case_II": 2, "planar_3rrr": 3}
NUMBER = re.compile(r"-?\d+\.\d+(?:e[+-]?\d+)?")


def gaps(chain: ClosedChain, q: np.ndarray) -> list[float]:
    """Distance between the frames of each closure [m]."""
    model, data = chain.model, chain.model.createData()
    pin.framesForwardKinematics(model, data, q)
    points = [[data.oMf[model.getFrameId(f)].translation for f in c.frames] for c in chain.closures]
    return [float(np.linalg.norm(b - a)) for a, b in points]


def test_every_function_has_its_files_and_every_file_its_function() -> None:
    """The urdf folder holds exactly the mechanisms of the generator."""
    assert io.shipped() == tuple(sorted(mechanisms.MECHANISMS))
    assert all(io.shipped_path(name).with_suffix(".yaml").is_file() for name in io.shipped())


@pytest.mark.parametrize("name", sorted(mechanisms.MECHANISMS))
def test_the_files_are_what_the_writer_makes_now(tmp_path: Path, name: str) -> None:
    """Text apart from numbers is equal, numbers to the last digits (the sines of another machine may differ there)."""
    made = io.save(mechanisms.MECHANISMS[name](), tmp_path, name=name, formats=("urdf",))
    for new, old in zip(made, (io.shipped_path(name), io.shipped_path(name).with_suffix(".yaml")), strict=True):
        texts = [path.read_text(encoding="utf-8") for path in (new, old)]
        assert NUMBER.sub("#", texts[0]) == NUMBER.sub("#", texts[1])
        numbers = [np.array(NUMBER.findall(text), dtype=float) for text in texts]
        np.testing.assert_allclose(numbers[0], numbers[1], rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("name", sorted(mechanisms.MECHANISMS))
def test_a_shipped_mechanism_is_closed_at_home_and_determined_by_its_motors(name: str) -> None:
    """Home closes every loop to round-off; the complement there has as many columns as the mobility, and full rank."""
    chain = io.load(io.shipped_path(name))
    home = np.array(chain.model.referenceConfigurations["home"])
    assert max(gaps(chain, home)) < 1e-15
    assert np.all(np.abs(home) <= np.pi)
    assert chain.na == MOBILITY.get(name, 1)
    N = kinematics.complement(chain, home)
    assert N.shape == (chain.nv, chain.na)
    assert np.linalg.matrix_rank(N) == chain.na


@pytest.mark.parametrize("name", sorted(mechanisms.MECHANISMS))
def test_a_shipped_mechanism_is_the_one_its_function_makes(name: str) -> None:
    """What is read from the file equals what is built in memory, to the last digit."""
    assert_same(mechanisms.MECHANISMS[name](), io.load(io.shipped_path(name)))


@pytest.mark.parametrize("name", sorted(mechanisms.MECHANISMS))
def test_mujoco_sees_the_same_mechanism(tmp_path: Path, name: str) -> None:
    """Mass matrix and closure of every shipped mechanism, written as MJCF, agree with MuJoCo's."""
    mujoco = pytest.importorskip("mujoco")
    chain = io.load(io.shipped_path(name))
    (path,) = io.save(chain, tmp_path, formats=("mjcf",))
    assert list(io.load(path).joints) == list(chain.joints)
    m = mujoco.MjModel.from_xml_path(str(path))
    d = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, d, 0)
    mujoco.mj_forward(m, d)
    assert np.abs(d.efc_pos[: m.neq * 3]).max() < 1e-15
    q = np.random.default_rng(0).normal(size=chain.nq)
    d.qpos[:] = q
    mujoco.mj_forward(m, d)
    M = mass_matrix(chain.model, q)
    columns = np.zeros((m.nv, m.nv))
    for column, unit in zip(columns, np.eye(m.nv), strict=True):
        mujoco.mj_mulM(m, d, column, unit)
    np.testing.assert_allclose(M, columns, rtol=0.0, atol=1e-12 * np.abs(M).max())
    equality = d.efc_pos[d.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY].reshape(-1, 3)
    np.testing.assert_allclose(np.linalg.norm(equality, axis=1), gaps(chain, q), rtol=1e-12)


def test_the_reactionless_four_bar_has_the_bodies_it_says() -> None:
    """Masses, mass centres and inertias are the stated ones; its mass centre does not move around the loop."""
    chain = io.load(io.shipped_path("four_bar_reactionless"))
    np.testing.assert_allclose([I.mass for I in chain.model.inertias[1:]], [1.0, 0.6, 1.0])
    q = np.array(chain.model.referenceConfigurations["home"])
    N = kinematics.complement(chain, q)
    com = pin.jacobianCenterOfMass(chain.model, chain.model.createData(), q) @ N
    assert np.abs(com).max() < 1e-15


@pytest.mark.parametrize(("sides", "loops"), [(("left",), 1), ("right", 1), (("right", "left"), 2)])
def test_solos_legs_close_into_five_bars(sides: tuple[str, ...], loops: int) -> None:
    """Hips 0.38 m apart, links of 0.16 m, feet together at home, two motors a loop; it can be saved and read."""
    chain = mechanisms.solo_legs(sides)
    home = np.array(chain.model.referenceConfigurations["home"])
    assert len(chain.closures) == loops
    assert chain.na == 2 * loops
    assert max(gaps(chain, home)) < 1e-15
    model, data = chain.model, chain.model.createData()
    pin.framesForwardKinematics(model, data, home)
    front, hind = chain.closures[0].name.split("_")
    hips = [data.oMi[model.getJointId(f"{leg}_HFE")].translation for leg in (front, hind)]
    np.testing.assert_allclose(hips[0] - hips[1], [0.38, 0.0, 0.0], atol=1e-12)
    knee = data.oMi[model.getJointId(f"{front}_KFE")].translation
    foot = data.oMf[model.getFrameId(f"{front}_FOOT")].translation
    spans = [np.linalg.norm((a - b)[[0, 2]]) for a, b in ((hips[0], knee), (knee, foot))]
    np.testing.assert_allclose(spans, [0.16, 0.16], rtol=1e-12)
    assert kinematics.complement(chain, home).shape == (4 * loops, 2 * loops)


def test_solos_legs_can_be_saved_and_read(tmp_path: Path) -> None:
    """The reduced robot, base included, comes back."""
    chain = mechanisms.solo_legs(("left", "right"))
    io.save(chain, tmp_path)
    assert_same(chain, io.load(tmp_path))


def test_wrong_names_list_the_right_ones() -> None:
    """Unknown mechanism, unknown side, another robot."""
    with pytest.raises(UnknownNameError, match="Did you mean 'delta'"):
        io.shipped_path("dleta")
    with pytest.raises(UnknownNameError, match="left, right"):
        mechanisms.solo_legs(("top",))
    with pytest.raises(UnknownNameError, match="joint of the robot"):
        mechanisms.solo_legs(urdf=io.shipped_path("delta"))
    with pytest.raises(FileFormatError, match="no such file"):
        mechanisms.solo_legs(urdf="nowhere.urdf")
