"""Motion laws: velocity and acceleration are the derivatives of the coordinate; ends, tables and errors."""

from __future__ import annotations

import numpy as np
import pytest

from fivebar_pin import Motion
from fivebar_pin import motion as laws
from fivebar_pin.errors import FileFormatError, InvalidInputError, OutputError

KNOTS = np.linspace(0.0, 2.0, 9)
T = np.linspace(0.3, 1.7, 57)
T = T[np.abs(T[:, None] - KNOTS).min(axis=1) > 5e-3]  # the fifth derivative of a spline jumps at its knots
VALUES = np.stack([np.sin(2.0 * KNOTS) + 0.1 * KNOTS, np.cos(3.0 * KNOTS)], axis=1)
CYCLE = VALUES - np.outer(KNOTS / 2.0, VALUES[-1] - VALUES[0])
LAWS = {
    "constant": lambda t: laws.constant(t, 0.7),
    "cycloidal": lambda t: laws.cycloidal(t, -0.4, 2.1, duration=3.0),
    "harmonic": lambda t: laws.harmonic(t, 0.2, 0.8, period=1.3, phase=0.4),
    "polynomial 3": lambda t: laws.polynomial(t, -0.4, 2.1, degree=3, duration=3.0),
    "polynomial 5": lambda t: laws.polynomial(t, -0.4, 2.1, degree=5, duration=3.0),
    "polynomial 7": lambda t: laws.polynomial(t, -0.4, 2.1, degree=7, duration=3.0),
    "spline": lambda t: laws.spline(t, KNOTS, VALUES),
    "periodic spline": lambda t: laws.spline(t, KNOTS, CYCLE, periodic=True),
}


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())
def test_rates_are_the_derivatives(law):
    # The laws measure time from their first instant, so all instants are evaluated together.
    h, t0 = 1e-3, np.array([0.0])
    at = law(np.r_[t0, T])
    steps = {k: law(np.r_[t0, T + k * h]) for k in (-3, -2, -1, 1, 2, 3)}
    for rate, of in (("v", "q"), ("a", "v")):
        d = [getattr(steps[k], of)[1:] - getattr(steps[-k], of)[1:] for k in (1, 2, 3)]
        central = (45.0 * d[0] - 9.0 * d[1] + d[2]) / (60.0 * h)
        np.testing.assert_allclose(getattr(at, rate)[1:], central, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("law", [laws.cycloidal, laws.polynomial], ids=["cycloidal", "polynomial"])
def test_moves_start_and_end_at_rest_and_stay_after_the_end(law):
    m = law(np.array([2.0, 2.5, 3.0, 3.5]), -0.4, 2.1, duration=1.0)
    np.testing.assert_allclose(m.q[:, 0], [-0.4, 0.85, 2.1, 2.1], rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(m.v[[0, 2, 3], 0], 0.0, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(m.a[[0, 2, 3], 0], 0.0, rtol=0.0, atol=1e-12)
    assert m.v[1, 0] > 2.5


def test_septic_has_no_jerk_at_the_ends_and_quintic_has():
    t = np.array([0.0, 1e-4])
    quintic, septic = (laws.polynomial(t, 0.0, 1.0, degree=d, duration=1.0).a[1, 0] / 1e-4 for d in (5, 7))
    assert quintic == pytest.approx(60.0, rel=1e-2)
    assert abs(septic) < 0.2


def test_spline_passes_through_its_values():
    m = laws.spline(KNOTS, KNOTS, VALUES)
    np.testing.assert_allclose(m.q, VALUES, rtol=0.0, atol=1e-13)


def test_a_cubic_move_brakes_to_its_very_end():
    """Its acceleration does not vanish there, -6 h / T^2, and is gone right after."""
    m = laws.polynomial([0.0, 1.0, 2.0, 2.0 + 1e-9], 1.0, 4.0, degree=3, duration=2.0)
    np.testing.assert_allclose(m.a[:, 0], [4.5, 0.0, -4.5, 0.0], rtol=0.0, atol=1e-14)


def test_periodic_spline_closes_smoothly():
    m = laws.spline(KNOTS[[0, -1]], KNOTS, CYCLE, periodic=True)
    for x in (m.q, m.v, m.a):
        np.testing.assert_allclose(x[0], x[1], rtol=0.0, atol=1e-10)
    assert np.abs(m.v[0]).max() > 0.1


def test_scaled_motion_is_the_same_path_at_another_speed():
    m = LAWS["spline"](T)
    fast = m.scaled(2.5)
    np.testing.assert_array_equal(fast.q, m.q)
    np.testing.assert_allclose(fast.t, m.t / 2.5, rtol=1e-15)
    np.testing.assert_allclose(fast.v, 2.5 * m.v, rtol=1e-15)
    np.testing.assert_allclose(fast.a, 6.25 * m.a, rtol=1e-15)
    for speed in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(InvalidInputError, match=r"speed .* must be positive and finite"):
            m.scaled(speed)


def test_combined_motions_stand_side_by_side():
    m = laws.combine(laws.constant(T, 1.0), LAWS["spline"](T))
    assert (m.na, len(m)) == (3, T.size)
    np.testing.assert_array_equal(m.q[:, 0], 1.0)
    with pytest.raises(InvalidInputError, match="must hold at least one motion"):
        laws.combine()
    with pytest.raises(InvalidInputError, match=r"motions\[1\].t .* must equal the times of motions\[0\]"):
        laws.combine(laws.constant(T, 1.0), laws.constant(T + 1e-9, 1.0))


def test_arrays_are_copied_and_read_only():
    q = np.zeros((3, 1))
    m = Motion(np.arange(3.0), q, q, q)
    q[0, 0] = 5.0
    assert m.q[0, 0] == 0.0
    for name in ("t", "q", "v", "a"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(m, name)[0] = 1.0


def test_a_table_written_is_read_back_to_the_last_bit(tmp_path):
    m = LAWS["spline"](T)
    laws.to_file(m, tmp_path / "m.csv", ("left", "right"))
    back = laws.from_file(tmp_path / "m.csv")
    for name in ("t", "q", "v", "a"):
        np.testing.assert_array_equal(getattr(back, name), getattr(m, name))
    for names in (("left",), ("left", "left")):
        with pytest.raises(InvalidInputError, match="must be 2 different names"):
            laws.to_file(m, tmp_path / "n.csv", names)
    with pytest.raises(InvalidInputError, match="must hold no comma"):
        laws.to_file(m, tmp_path / "n.csv", ("left,right", "up"))


def test_a_table_is_not_replaced_unless_told_to_and_an_unwritable_one_is_named(tmp_path):
    """Nothing is lost by writing, and no raw OSError comes out."""
    first, second = (laws.constant(T, x) for x in (1.0, 2.0))
    laws.to_file(first, tmp_path / "m.csv", ("x",))
    with pytest.raises(OutputError, match="exists already"):
        laws.to_file(second, tmp_path / "m.csv", ("x",))
    assert laws.from_file(tmp_path / "m.csv").q[0, 0] == 1.0
    laws.to_file(second, tmp_path / "m.csv", ("x",), overwrite=True)
    assert laws.from_file(tmp_path / "m.csv").q[0, 0] == 2.0
    with pytest.raises(OutputError, match="cannot be written"):
        laws.to_file(first, tmp_path / "none" / "m.csv", ("x",))


def test_columns_are_found_by_name_whatever_their_order(tmp_path):
    (tmp_path / "m.csv").write_text("a_x, q_x,t,v_x,note\n4,2,0,3,9\n5,3,1,4,9\n")
    m = laws.from_file(tmp_path / "m.csv")
    np.testing.assert_array_equal([m.t, m.q[:, 0], m.v[:, 0], m.a[:, 0]], [[0, 1], [2, 3], [3, 4], [4, 5]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,q_x,v_x\n0,1,2\n", "missing a_x"),
        ("t,x\n0,1\n", "missing q_"),
        ("", "needs the columns t, q_"),
        ("t,q_x,v_x,a_x\n0,1,2,3\n1,2\n", "row 3 has 2 cells, the header has 4"),
        ("t,q_x,v_x,a_x\n0,one,2,3\n", "row 2 is not numeric"),
        ("t,q_x,v_x,a_x,t\n0,1,2,3,4\n", "two columns of one name"),
    ],
)
def test_broken_tables_are_named(tmp_path, text, message):
    (tmp_path / "m.csv").write_text(text)
    with pytest.raises(FileFormatError, match=message) as info:
        laws.from_file(tmp_path / "m.csv")
    assert info.value.path.endswith("m.csv")


def test_tables_without_rows_or_with_gaps_or_that_do_not_exist_are_refused(tmp_path):
    (tmp_path / "m.csv").write_text("t,q_x,v_x,a_x\n0,nan,2,3\n")
    with pytest.raises(InvalidInputError, match=r"motion.q\[0, 0\] = nan but must be finite"):
        laws.from_file(tmp_path / "m.csv")
    (tmp_path / "m.csv").write_text("t,q_x,v_x,a_x\n")
    with pytest.raises(InvalidInputError, match="at least one sample"):
        laws.from_file(tmp_path / "m.csv")
    (tmp_path / "m.csv").write_bytes(b"\xff\xfe\x00t,q")
    with pytest.raises(FileFormatError):
        laws.from_file(tmp_path / "m.csv")
    with pytest.raises(FileFormatError, match="cannot be read"):
        laws.from_file(tmp_path / "none.csv")


def test_positions_alone_get_their_rates_from_a_quintic_spline(tmp_path):
    """Exact for a polynomial of degree five; too few samples are named with what is needed."""
    t = np.linspace(0.0, 1.0, 9)
    q = np.polynomial.Polynomial([0.1, -0.4, 0.3, 0.7, -0.2, 0.5])
    rows = "".join(f"{float(a)!r},{float(b)!r}\n" for a, b in zip(t, q(t), strict=True))
    (tmp_path / "m.csv").write_text("t [s],q crank [rad]\n" + rows)
    m = laws.from_file(tmp_path / "m.csv")
    np.testing.assert_allclose(m.v[:, 0], q.deriv()(t), rtol=0, atol=1e-11)
    np.testing.assert_allclose(m.a[:, 0], q.deriv(2)(t), rtol=0, atol=1e-10)
    (tmp_path / "m.csv").write_text("t,q_x\n0,1\n1,2\n")
    with pytest.raises(InvalidInputError, match="at least six"):
        laws.from_file(tmp_path / "m.csv")


@pytest.mark.parametrize(
    "head",
    [
        "t [s],q one [rad],v one [rad/s],a one [rad/s2],q two [m],v two [m/s],a two [m/s2]",
        "t [s],one [rad],done [rad/s],ddone [rad/s2],two [m],dtwo [m/s],ddtwo [m/s2]",
        "t,q_one,v_one,a_one,q_two,v_two,a_two",
    ],
)
def test_headers_with_units_are_read_and_columns_are_taken_by_name(tmp_path, head):
    (tmp_path / "m.csv").write_text(head + ",tau one [N m]\n0,1,2,3,4,5,6,7\n1,2,3,4,5,6,7,8\n")
    both = laws.from_file(tmp_path / "m.csv")
    np.testing.assert_array_equal(both.q, [[1.0, 4.0], [2.0, 5.0]])
    turned = laws.from_file(tmp_path / "m.csv", ("two", "one"))
    np.testing.assert_array_equal(turned.v, [[5.0, 2.0], [6.0, 3.0]])
    np.testing.assert_array_equal(laws.from_file(tmp_path / "m.csv", ("two",)).a[:, 0], [6.0, 7.0])
    np.testing.assert_array_equal(laws.from_file(tmp_path / "m.csv", ("x", "y")).q, both.q)
    with pytest.raises(FileFormatError, match="missing q_three, v_three, a_three; coordinates there: one, two"):
        laws.from_file(tmp_path / "m.csv", ("one", "three"))
    with pytest.raises(FileFormatError, match="missing q_x; coordinates there: one, two"):
        laws.from_file(tmp_path / "m.csv", ("x",))  # none of these names, and not as many


def test_other_units_are_not_taken_for_ours(tmp_path):
    for head, known in (
        ("t [ms],q x [rad],v x [rad/s],a x [rad/s2]", "s"),
        ("t [s],q x [deg],v x [rad/s],a x [rad/s2]", "rad or m or -"),
        ("t [s],q x [rad],v x [rpm],a x [rad/s2]", "rad/s or m/s"),
        ("t [s],q x [rad],v x [rad/s],a x [deg/s2]", "rad/s2 or m/s2"),
    ):
        (tmp_path / "m.csv").write_text(head + "\n0,1,2,3\n")
        with pytest.raises(FileFormatError, match=f"unit must be {known}.*, convert it first"):
            laws.from_file(tmp_path / "m.csv")


Z = np.zeros((3, 1))


def all_but_closed() -> np.ndarray:
    """Return the values of a cycle that misses its start by a millionth."""
    values = np.array(CYCLE, dtype=float)
    values[-1] += 1e-6
    return values


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Motion(np.arange(3.0), Z, Z, np.zeros((2, 1))), r"shape of motion.a = \(2, 1\) but must be \(3, 1\)"),
        (lambda: Motion(np.arange(3.0), Z[:, 0], Z, Z), r"shape of motion.q = \(3,\) but must be \(3, n\)"),
        (lambda: Motion(np.array([0.0, 1.0, 1.0]), Z, Z, Z), r"motion.t\[2\] = 1.0 but times must increase"),
        (lambda: Motion(np.zeros(0), np.zeros((0, 1)), np.zeros((0, 1)), np.zeros((0, 1))), "at least one sample"),
        (lambda: Motion(np.arange(3.0), Z, Z + np.inf, Z), r"motion.v\[0, 0\] = inf but must be finite"),
        (lambda: Motion("abc", Z, Z, Z), "motion.t = 'abc' but must be an array of numbers"),
        (lambda: laws.cycloidal([], 0.0, 1.0), "t = .* must hold at least one sample"),
        (lambda: laws.cycloidal([0.0], 0.0, 1.0), "duration = 0.0 but must be positive"),
        (lambda: laws.cycloidal([0.0, 1.0], 0.0, 1.0, duration=-1.0), "duration = -1.0 but must be positive"),
        (lambda: laws.harmonic(T, 0.0, 1.0, period=0.0), "period = 0.0 but must be positive"),
        (lambda: laws.polynomial(T, 0.0, 1.0, degree=4), r"degree = 4 but must be one of \[3, 5, 7\]"),
        (lambda: laws.spline(T, KNOTS[:5], VALUES[:5]), "knots .* must be at least six, strictly increasing"),
        (lambda: laws.spline(T, KNOTS[::-1], VALUES), "strictly increasing"),
        (lambda: laws.spline(T + 1.0, KNOTS, VALUES), r"t = .* must lie within \[0.0, 2.0\]"),
        (lambda: laws.spline(T, KNOTS, VALUES, periodic=True), r"values\[-1\] .* must equal values\[0\]"),
        (lambda: laws.spline(T, KNOTS, all_but_closed(), periodic=True), r"values\[-1\] .* must equal values\[0\]"),
        (lambda: laws.spline(T, KNOTS, VALUES[:4]), r"shape of values"),
        (lambda: laws.constant(T, np.nan), "value = nan but must be finite"),
        (lambda: laws.constant(T, "high"), "value = 'high' but must be one number"),
        (lambda: laws.cycloidal(T, [0.0, 1.0], 2.0), r"start = \[0.0, 1.0\] but must be one number"),
        (lambda: laws.cycloidal(T, 0.0, 1.0, duration="long"), "duration = 'long' but must be one number"),
        (lambda: laws.harmonic(T, 0.0, 1.0, period="a"), "period = 'a' but must be one number"),
        (lambda: laws.harmonic(T, 0.0, None, period=1.0), "amplitude = None but must be one number"),
        (lambda: laws.polynomial(T, 0.0, 1.0, degree=[5]), r"degree = \[5\] but must be one of \[3, 5, 7\]"),
        (lambda: laws.spline(T, KNOTS, "abc"), "values = 'abc' but must be an array of numbers"),
        (lambda: laws.constant(T, 1.0).scaled("fast"), "speed = 'fast' but must be one number"),
    ],
)
def test_bad_motions_are_refused(make, message):
    with pytest.raises(InvalidInputError, match=message):
        make()
