"""The averaged J2 model: its closed form, its initial conditions, and Roberts' cross-track equation (25)."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from formation_gnc.errors import OrbitError
from formation_gnc.orbit.constants import EARTH_RADIUS, J2, MU
from formation_gnc.orbit.elements import elements_from_state
from formation_gnc.relative.chief import OblateChief
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.j2_gradient import circular_gradient
from formation_gnc.relative.model import RelativeModel
from formation_gnc.relative.oblate import OblateModel
from formation_gnc.relative.schweighart_sedwick import (
    CircularReference,
    SchweighartSedwickModel,
    SchweighartSedwickNodalModel,
)

references = st.builds(CircularReference, st.floats(6.6e6, 4.2e7), st.floats(0.0, math.pi), st.floats(0.0, 6.28))
numbers = st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6)


def scaled(reference, matrix):
    """Matrix in units where time is 1 / n."""
    unit = np.repeat([1.0, reference.mean_motion], 3)
    return matrix * unit[: matrix.shape[1]] / unit[:, None]


@given(references)
@pytest.mark.covers("Roberts (22)-(24)", "relative/schweighart_sedwick.py")
def test_dynamics_has_the_averaged_gradient(reference):
    n, c2 = reference.mean_motion, 1.0 + reference.averaged
    average = np.zeros((3, 3))
    for row in range(3):
        for column in range(3):
            average[row, column] = quad(
                lambda u, r=row, k=column: circular_gradient(reference, u)[r, k], 0.0, math.tau
            )[0]
    average /= math.tau
    expected = np.diag([2.0, -1.0, -1.0]) + average + np.diag([c2, c2, 0.0])  # gravity and the frame's turning
    matrix = SchweighartSedwickModel(reference).dynamics()
    np.testing.assert_allclose(matrix[3:, :3] / n**2, expected, atol=1e-12)
    # Roberts (24)
    np.testing.assert_allclose(np.diag(expected), [5 * c2 - 2, 0.0, -(3 * c2 - 2)], atol=1e-12)


@given(references)
@pytest.mark.covers("Roberts (13)-(16)", "relative/schweighart_sedwick.py")
def test_averaged_acceleration_is_radial_and_sets_the_orbital_rate(reference):
    # Roberts (13), (15): n^2 c^2 r balances gravity and the averaged J2 acceleration.
    r, i = reference.radius, reference.inclination
    radial = quad(lambda u: 1.0 - 3.0 * (math.sin(i) * math.sin(u)) ** 2, 0.0, math.tau)[0] / math.tau
    inward = MU / r**2 + 1.5 * J2 * MU * EARTH_RADIUS**2 / r**4 * radial
    assert reference.rate**2 * r == pytest.approx(inward, rel=1e-12)


@pytest.mark.parametrize("kind", [SchweighartSedwickModel, SchweighartSedwickNodalModel])
# Below a microsecond, rounding leaves too few digits for a comparison.
@given(
    reference=references,
    start=st.floats(-1.0, 1.0),
    turns=st.floats(-1.5, 1.5).filter(lambda turns: abs(turns) > 1e-9),
)
@pytest.mark.thorough
def test_closed_form_solves_the_differential_equation(kind, reference, start, turns):
    model = kind(reference)
    time, duration = start * 1e4, turns * math.tau / reference.mean_motion

    class Integrated(SchweighartSedwickNodalModel):
        longest_step = 0.005 * math.tau / reference.mean_motion

        def dynamics(self, time, state=None):
            return model.dynamics(time)

    phi, gamma = model.discretise(time, duration)
    integrated = RelativeModel.discretise(Integrated(reference), time, duration)
    for ours, other in zip((phi, gamma), integrated, strict=True):
        ours, other = scaled(reference, ours), scaled(reference, other)
        np.testing.assert_allclose(ours, other, atol=1e-10 * np.abs(other).max())


@given(references, st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_transition_is_a_group_of_unit_determinant(reference, first, second):
    model = SchweighartSedwickNodalModel(reference)
    one, two = first * model.period, second * model.period
    whole = scaled(reference, model.transition(0.0, one + two))
    parts = scaled(reference, model.transition(one, two)), scaled(reference, model.transition(0.0, one))
    np.testing.assert_allclose(parts[0] @ parts[1], whole, atol=1e-10 * np.abs(whole).max())
    in_plane = np.ix_([0, 1, 3, 4], [0, 1, 3, 4])
    assert np.linalg.det(parts[1][in_plane]) == pytest.approx(1.0, abs=1e-9)


@given(references, numbers)
@pytest.mark.covers("Roberts (32)-(34)", "relative/schweighart_sedwick.py")
def test_centred_state_has_no_drift_and_no_offset(reference, values):
    model = SchweighartSedwickModel(reference)
    unit = np.repeat([1.0, reference.mean_motion], 3)
    state = np.array(values) * unit
    turns = np.arange(64) * model.period / 64
    bounded = model.propagate(0.0, model.bounded(0.0, state), turns + 5 * model.period)
    np.testing.assert_allclose(
        bounded[:, [0, 1]], model.propagate(0.0, model.bounded(0.0, state), turns)[:, [0, 1]], atol=1e-11
    )
    centred = model.propagate(0.0, model.centred(0.0, state), turns)
    np.testing.assert_allclose(centred[:, [0, 1]].mean(axis=0), 0.0, atol=1e-12)  # Roberts (32), (33)
    q = model.frequencies[1]
    assert q == pytest.approx(reference.mean_motion * math.sqrt(1.0 - reference.averaged), rel=1e-14, abs=0.0)


@settings(max_examples=10)
@given(st.floats(6.6e6, 4.2e7), st.floats(0.05, math.pi - 0.05), numbers)
@pytest.mark.thorough
@pytest.mark.covers("Roberts (1)-(8); (26)-(31)", "relative/schweighart_sedwick.py")
def test_perturbed_satellite_from_the_equator_stays_by_the_reference(radius, inclination, values):
    # Roberts (28)-(30) and the averaged gradient with the J2 forces of (35) left unaveraged.
    reference = CircularReference(radius, inclination)
    model = SchweighartSedwickModel(reference)
    state = model.on_the_equator(np.array(values) * np.repeat([1e3, 1e3 * reference.mean_motion], 3))
    strength = 1.5 * reference.oblateness * reference.mean_motion**2 * radius * math.sin(inclination) ** 2
    k, dynamics = reference.nodal_rate, model.dynamics()

    def rate(t, s):
        result = dynamics @ s
        # J2 less its average and its normal part: Roberts (4), (13), (14)
        result[3] -= strength * 1.5 * math.cos(2 * k * t)
        result[4] -= strength * math.sin(2 * k * t)
        return result

    turn = math.pi / k
    solution = solve_ivp(rate, (0.0, 40 * turn), state, method="DOP853", rtol=1e-11, atol=1e-9, dense_output=True)
    means = [
        np.mean(solution.sol(start * turn + np.linspace(0.0, 4 * turn, 400, endpoint=False))[:2], axis=1)
        for start in (0, 36)
    ]
    # One part in a hundred of the initial offset: averages are over two orbits, not a common period.
    size = np.abs(state[:2]).max() + strength / reference.mean_motion**2
    assert abs(means[1][1] - means[0][1]) < 0.03 * size
    assert abs(means[0][1]) < 0.03 * size


def schweighart_sedwick_constants(reference, state):
    """q, l and phi of Roberts (25), from Schweighart and Sedwick (2002), which Roberts does not repeat.

    Of two satellites that start on the equator: orbit planes at inclinations i and i2, nodes dO apart.
    """
    n, r, i = reference.mean_motion, reference.radius, reference.inclination
    k = reference.nodal_rate
    i2 = i + state[5] / (k * r)
    node = -state[2] / (r * math.sin(i))  # a node further east puts the satellite to the south
    drift, drift2 = (-1.5 * n * reference.oblateness * math.cos(value) for value in (i, i2))
    across = (math.cos(i2) / math.sin(i2) * math.sin(i) - math.cos(i) * math.cos(node)) / math.sin(node)
    gamma = math.atan2(1.0, across)
    angle = math.acos(math.cos(i) * math.cos(i2) + math.sin(i) * math.sin(i2) * math.cos(node))
    q = reference.rate - drift * math.cos(i)
    q -= (math.cos(gamma) * math.sin(gamma) / math.tan(node) - math.sin(gamma) ** 2 * math.cos(i)) * (drift - drift2)
    growth = -r * math.sin(i) * math.sin(i2) * math.sin(node) / math.sin(angle) * (drift - drift2)
    return q, growth


@pytest.mark.covers(
    "Roberts (25)",
    "relative/schweighart_sedwick.py",
    differs="l, q and φ are not defined there: those of Schweighart and Sedwick (2002)",
)
def test_cross_track_extension_equals_that_of_schweighart_and_sedwick():
    reference = CircularReference(7e6, math.radians(35.0))
    # Starting on the equator with z = -r sin i dO: the nodes of the two planes apart, and the inclinations.
    state = np.array([0.0, 0.0, 1000.0, 0.0, 0.0, 1.3])
    q, growth = schweighart_sedwick_constants(reference, state)
    # m and phi from z = (l t + m) sin(q t + phi) and its rate at the start
    phi = math.atan2(q * state[2], state[5])
    for _ in range(50):
        phi = math.atan2(q * state[2], state[5] - growth * math.sin(phi))
    m = state[2] / math.sin(phi)
    model = SchweighartSedwickNodalModel(reference)
    times = np.linspace(0.0, 20 * model.period, 200)
    ours = np.array([model.propagate(0.0, state, float(t))[2] for t in times])
    theirs = (growth * times + m) * np.sin(q * times + phi)
    averaged = SchweighartSedwickModel(reference).propagate(0.0, state, times)[:, 2]
    error, without = np.abs(ours - theirs).max(), np.abs(averaged - theirs).max()
    # Theirs is of first order in time, here over 20 orbits.
    assert error < 0.002 * abs(m)
    assert without > 20.0 * error


@pytest.mark.parametrize("inclination", [35.0, 97.87])
@pytest.mark.thorough
@pytest.mark.covers("Kremmydas 1.1.4, Schweighart-Sedwick", "relative/schweighart_sedwick.py")
def test_cross_track_extension_improves_on_the_average(inclination):
    reference = CircularReference(7e6, math.radians(inclination))
    model = SchweighartSedwickNodalModel(reference)
    start = model.in_plane.on_the_equator(np.zeros(6))
    speed = 7e6 * reference.rate + start[4]
    leader = [7e6, 0, 0, 0, speed * math.cos(reference.inclination), speed * math.sin(reference.inclination)]
    truth = OblateModel(OblateChief(elements_from_state(np.array(leader))))
    state = np.array([0.0, 0.0, 1000.0, 0.0, 0.0, 1.3])
    follower = truth.bounded(0.0, state)
    errors = []
    for _ in range(4):
        time = 0.99 * model.period * len(errors)
        averaged = model.in_plane.propagate(0.0, state, time)[2]
        errors.append([model.propagate(0.0, state, time)[2] - follower[2], averaged - follower[2]])
        follower = truth.propagate(time, follower, 0.99 * model.period)
    ours, without = np.abs(errors).max(axis=0)
    # A metre in 1600: the relative orbit's own short-period J2 terms, which neither model has.
    assert ours < 1.0
    assert without > 10.0 * ours


def test_model_far_out_tends_to_hills():
    # s scales as r^-2: far out the difference from Hill's equations falls by four at twice the radius.
    differences = []
    for radius in (4e7, 8e7):
        reference = CircularReference(radius, 0.4)
        ours = scaled(reference, SchweighartSedwickNodalModel(reference).transition(0.0, 1e4 * (radius / 4e7) ** 1.5))
        hill = HillModel(reference.mean_motion).transition(0.0, 1e4 * (radius / 4e7) ** 1.5)
        differences.append(np.abs(ours - scaled(reference, hill)).max())
    assert differences[0] / differences[1] == pytest.approx(4.0, rel=1e-3)


@pytest.mark.parametrize("inclination", [0.0, math.pi / 2])
def test_cross_track_extension_is_regular_at_any_inclination_and_state(inclination):
    model = SchweighartSedwickNodalModel(CircularReference(7e6, inclination))
    assert np.isfinite(model.transition(0.0, 1e4)).all()
    np.testing.assert_array_equal(model.propagate(0.0, np.zeros(6), 1e4), np.zeros(6))


@pytest.mark.parametrize(("radius", "inclination"), [(6e6, 1.0), (math.nan, 1.0), (7e6, math.inf)])
def test_invalid_reference_is_rejected_by_name(radius, inclination):
    with pytest.raises(OrbitError, match=r"radius|inclination"):
        CircularReference(radius, inclination)
