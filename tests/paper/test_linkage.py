"""The paper's linkage as parameters, as a chain, as configurations."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pinocchio as pin
import pytest

from fivebar_pin import paper
from fivebar_pin.errors import AssemblyError, InvalidInputError, SingularityError, UnknownNameError

GOOD = {
    "lengths": (0.02, 0.1, 0.09, 0.04, 0.05),
    "masses": (0.03, 0.15, 0.12, 0.06),
    "inertias": (1e-6, 1.25e-4, 1e-4, 8e-6),
    "rho": (0.5, 0.6, -0.3, 1.4),
    "alpha": (0.1, -0.2, 0.3, 0.4),
}


@pytest.mark.parametrize(
    ("field", "index", "value", "message"),
    [
        ("lengths", 1, 0.0, r"lengths\[1\] = 0.0 but must be positive"),
        ("lengths", 4, -0.1, r"lengths\[4\] = -0.1 but must be positive"),
        ("masses", 2, -1.0, r"masses\[2\] = -1.0 but must be positive"),
        ("inertias", 0, 0.0, r"inertias\[0\] = 0.0 but is too small for a mass of 0.03 kg"),
        ("inertias", 3, -1e-9, r"inertias\[3\] = -1e-09 but is too small for a mass of 0.06 kg"),
        ("rho", 1, np.nan, r"rho\[1\] = nan but must be finite"),
        ("alpha", 2, np.inf, r"alpha\[2\] = inf but must be finite"),
        ("lengths", 0, np.nan, r"lengths\[0\] = nan but must be finite"),
    ],
)
def test_impossible_parameters_are_refused_by_name_and_value(field, index, value, message):
    """Every bad number is named with its value and the rule it breaks."""
    values = list(GOOD[field])
    values[index] = value
    with pytest.raises(InvalidInputError, match=message):
        paper.FiveBar(**(GOOD | {field: values}))


@pytest.mark.parametrize("field", list(GOOD))
def test_parameters_of_the_wrong_shape_are_refused(field):
    """The shape is checked for every field."""
    with pytest.raises(InvalidInputError, match=f"shape of {field} = "):
        paper.FiveBar(**(GOOD | {field: (1.0, 1.0)}))


def test_a_linkage_cannot_be_changed_from_outside():
    """Arrays are copied in and read-only, fields frozen."""
    lengths = np.array(GOOD["lengths"])
    linkage = paper.FiveBar(**(GOOD | {"lengths": lengths}))
    lengths[0] = 9.0
    assert linkage.lengths[0] == 0.02
    with pytest.raises(ValueError, match="read-only"):
        linkage.masses[0] = 1.0
    with pytest.raises(FrozenInstanceError):
        linkage.masses = lengths
    assert "lengths=[0.02" in repr(linkage)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("III", "unbalanced", "printed"), "Unknown case 'III'; known: I, II"),
        (("I", "balance", "printed"), "Unknown column 'balance'; known: unbalanced, balanced. Did you mean"),
        (("I", "balanced", "guess"), "Unknown reading 'guess'; known: printed, corrected"),
    ],
)
def test_unknown_columns_of_table_1_list_the_known_ones(arguments, message):
    """Names are checked against the table."""
    with pytest.raises(UnknownNameError, match=message):
        paper.table_1(*arguments[:2], reading=arguments[2])


def test_table_1_supplies_the_forgotten_crank_and_both_readings():
    """|r_12| is that of the uniform rods; the corrected reading changes only m2 and m3 of case II balanced."""
    assert paper.table_1("I", "unbalanced").lengths[0] == 0.02
    assert paper.table_1("II", "balanced").lengths[0] == 0.035
    printed, corrected = (paper.table_1("II", "balanced", reading=r) for r in ("printed", "corrected"))
    np.testing.assert_array_equal(corrected.masses / printed.masses, [1.0, 10.0, 10.0, 1.0])
    for case, column in (("I", "unbalanced"), ("I", "balanced"), ("II", "unbalanced")):
        a, b = (paper.table_1(case, column, reading=r) for r in ("printed", "corrected"))
        np.testing.assert_array_equal(a.masses, b.masses)


def test_default_motion_is_the_stated_one():
    """psi turns once along a cycloid, gamma = pi/3 + (pi/6)(1 - cos 2 pi t / T); v and a are its derivatives."""
    m = paper.default_motion(samples=2001, period=2.0)
    np.testing.assert_allclose(m.q[[0, -1], 0], [0.0, 2.0 * np.pi], atol=1e-15)
    np.testing.assert_allclose(m.q[:, 1], np.pi / 3 + np.pi / 6 * (1 - np.cos(np.pi * m.t)), atol=1e-14)
    np.testing.assert_allclose(np.gradient(m.q, m.t, axis=0)[1:-1], m.v[1:-1], atol=2e-5)
    np.testing.assert_allclose(np.gradient(m.v, m.t, axis=0)[1:-1], m.a[1:-1], atol=1e-4)
    assert m.v[0, 0] == 0.0


@pytest.mark.parametrize(("keywords", "name"), [({"samples": 1}, "samples"), ({"samples": 2.5}, "samples")])
def test_default_motion_refuses_bad_sample_counts(keywords, name):
    """At least two samples."""
    with pytest.raises(InvalidInputError, match=f"{name} = .* must be an integer of at least 2"):
        paper.default_motion(**keywords)


def test_default_motion_refuses_a_bad_period():
    """The period is positive."""
    with pytest.raises(InvalidInputError, match=r"period = 0\.0 but must be positive"):
        paper.default_motion(period=0.0)


def test_the_chain_has_the_layout_that_a_urdf_read_back_has():
    """Joints depth-first in alphabetical order; links, closure frames and motors by their names; zero gravity."""
    chain = paper.FiveBar(**GOOD).chain()
    assert chain.joints == ("gamma", "phi_gamma", "psi", "theta_psi")
    assert chain.actuated == ("psi", "gamma")
    assert (chain.nq, chain.nv) == (4, 4)
    assert chain.closures[0].frames == ("O3_link2", "O3_link3")
    names = [f.name for f in chain.model.frames]
    assert {"link1", "link2", "link3", "link4", "O3_link2", "O3_link3"} <= set(names)
    np.testing.assert_array_equal(chain.model.gravity.linear, np.zeros(3))
    np.testing.assert_array_equal(
        paper.FiveBar(**GOOD).chain(gravity=(0.0, -9.81, 0.0)).model.gravity.linear, [0.0, -9.81, 0.0]
    )
    with pytest.raises(InvalidInputError, match="shape of gravity"):
        paper.FiveBar(**GOOD).chain(gravity=(0.0, 1.0))


@pytest.mark.parametrize("mode", paper.AssemblyMode)
def test_mass_centres_lie_where_rho_and_alpha_put_them(mode):
    """r_i = rho_i R(alpha_i) r_{i,i+1} from O_i, in the order O1 O2 O3 O4 O0, measured on the Pinocchio model."""
    linkage = paper.FiveBar(**GOOD)
    chain = linkage.chain()
    q = linkage.configuration(0.7, 1.9, mode=mode)
    model, data = chain.model, chain.model.createData()
    pin.framesForwardKinematics(model, data, q)
    at = {name: data.oMi[model.getJointId(name)].translation[:2] for name in chain.joints}
    O3 = data.oMf[model.getFrameId("O3_link2")].translation[:2]
    np.testing.assert_allclose(O3, data.oMf[model.getFrameId("O3_link3")].translation[:2], atol=1e-15)
    points = [at["psi"], at["theta_psi"], O3, at["phi_gamma"], at["gamma"]]
    for i, joint in enumerate(("psi", "theta_psi", "phi_gamma", "gamma")):
        turn = linkage.alpha[i]
        R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        wanted = points[i] + linkage.rho[i] * R @ (points[i + 1] - points[i])
        j = model.getJointId(joint)
        np.testing.assert_allclose(data.oMi[j].act(model.inertias[j].lever)[:2], wanted, atol=1e-15)
        assert model.inertias[j].inertia[2, 2] == linkage.inertias[i]
    side = np.cross([*(points[3] - points[1]), 0.0], [*(O3 - points[1]), 0.0])[2]
    assert np.sign(side) == mode.sign


def test_bodies_are_flat_and_physical():
    """The pseudo-inertia of every body is positive semidefinite, with nothing out of the plane."""
    for inertia in list(paper.FiveBar(**GOOD).chain().model.inertias)[1:]:
        S = inertia.inertia
        second = 0.5 * np.trace(S) * np.eye(3) - S
        assert np.linalg.eigvalsh(second).min() >= -1e-18
        assert abs(second[2, 2]) <= 1e-18


def test_visuals_follow_the_lengths():
    """Twice the linkage has twice the shapes; every link is drawn."""
    linkage = paper.FiveBar(**GOOD)
    small = linkage.chain().visuals
    large = replace(linkage, lengths=2.0 * linkage.lengths).chain().visuals
    assert {v.frame for v in small} == {"link1", "link2", "link3", "link4"}
    for a, b in zip(small, large, strict=True):
        np.testing.assert_allclose(b.size, 2.0 * np.array(a.size))
        np.testing.assert_allclose(b.placement[:3, 3], 2.0 * a.placement[:3, 3])


def test_configuration_takes_one_pose_or_many():
    """A scalar call is the same function without the leading axis."""
    linkage = paper.FiveBar(**GOOD)
    psi, gamma = np.array([0.1, 0.9, 2.0]), np.array([1.0, 1.4, 2.0])
    many = linkage.configuration(psi, gamma)
    assert many.shape == (3, 4)
    for k in range(3):
        np.testing.assert_array_equal(linkage.configuration(psi[k], gamma[k]), many[k])


def test_a_pose_out_of_reach_names_the_sample_and_the_gap():
    """By how much the loop stays open [m], and which sample is the worst."""
    far = paper.FiveBar(**(GOOD | {"lengths": (0.3, 0.1, 0.1, 0.3, 0.5)}))
    with pytest.raises(AssemblyError, match=r"sample 1: .*1\.1 m apart, .* reach 0\.2 m; .* open by 0\.9 m") as caught:
        far.configuration([1.2, np.pi], [1.9, 0.0])
    assert caught.value.sample == 1
    assert caught.value.residual == pytest.approx(0.9)
    near = paper.FiveBar(**(GOOD | {"lengths": (0.1, 0.5, 0.1, 0.1, 0.2)}))
    with pytest.raises(AssemblyError, match=r"need 0\.4 m; the loop stays open by 0\.2 m"):
        near.configuration(np.pi / 2, np.pi / 2)


def test_a_stretched_pose_is_a_singularity():
    """O2, O3, O4 on a line: 0.1 + 0.1 = 0.2 m apart."""
    straight = paper.FiveBar(**(GOOD | {"lengths": (0.1, 0.1, 0.1, 0.1, 0.2)}))
    with pytest.raises(SingularityError, match="O2, O3 and O4 lie on a line at sample 0") as caught:
        straight.configuration(np.pi / 2, np.pi / 2)
    assert caught.value.sigma <= 1e-7


def test_unknown_assembly_mode_lists_the_known_ones():
    """The word works too; a wrong one is told."""
    linkage = paper.FiveBar(**GOOD)
    np.testing.assert_array_equal(
        linkage.configuration(0.3, 1.5, mode="right"), linkage.configuration(0.3, 1.5, mode=paper.AssemblyMode.RIGHT)
    )
    with pytest.raises(UnknownNameError, match="Unknown assembly mode 'up'; known: left, right"):
        linkage.configuration(0.3, 1.5, mode="up")


def test_configuration_refuses_angles_that_do_not_pair_up():
    """psi and gamma have the same length; a scalar goes with every value; words are no angles."""
    linkage = paper.FiveBar(**GOOD)
    with pytest.raises(InvalidInputError, match="shape of gamma"):
        linkage.configuration([0.1, 0.2], [1.0, 1.1, 1.2])
    np.testing.assert_array_equal(linkage.configuration([0.1, 0.2], 1.0), linkage.configuration([0.1, 0.2], [1.0, 1.0]))
    with pytest.raises(InvalidInputError, match="psi = 'a' but must be an array of numbers"):
        linkage.configuration("a", 1.0)
