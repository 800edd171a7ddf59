"""Relative orbital elements: maps against absolute elements, transition matrices against the propagated truth."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.errors import OrbitError
from formation_gnc.orbit.constants import EARTH_RADIUS, J2
from formation_gnc.orbit.elements import Elements, elements_from_state, state_from_elements
from formation_gnc.orbit.mean import mean_elements, osculating_elements, secular_rates
from formation_gnc.orbit.propagation import propagate_with_transition
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.relative_elements import (
    deputy_elements,
    drag_response,
    hill_matrix,
    j2_transition,
    kepler_transition,
    least_separation,
    mean_relative_elements,
    near_circular_elements,
    near_circular_matrix,
    osculating_relative_elements,
    relative_elements,
    state_from_mean,
    state_from_osculating,
)
from formation_gnc.relative.tschauner_hempel import TschaunerHempelModel

NO_THRUST = np.zeros(3)

TERRASAR = Elements(6886536.686, 0.0001264, math.radians(97.4453), math.radians(351.0108), math.radians(101.2452), 0.2)

orbits = st.builds(
    lambda perigee, *rest: Elements(perigee / (1.0 - rest[0]), *rest),
    st.floats(6.9e6, 4.2e7),
    st.floats(0.0, 0.7),
    st.floats(0.1, math.pi - 0.1),
    *[st.floats(0.0, 6.28)] * 3,
)
formations = st.tuples(*[st.floats(-1e3, 1e3)] * 6).map(np.array)


def later(state, duration):
    """Inertial state under point mass and J2."""
    return propagate_with_transition(state, NO_THRUST, duration, max(1, math.ceil(abs(duration) / 20.0)))[0]


@given(orbits, formations)
def test_elements_and_states_map_to_and_fro_exactly(chief, relative):
    inertial = state_from_elements(chief)
    for to_state, to_elements in (
        (state_from_osculating, osculating_relative_elements),
        (state_from_mean, mean_relative_elements),
    ):
        found = to_elements(inertial, to_state(inertial, relative))
        # Rounding of an orbit of 1e7 to 1e8 m, and of its anomaly by 1 / (1 - e)^2.
        np.testing.assert_allclose(found, relative, rtol=0.0, atol=2e-13 * chief.semi_major_axis)


@given(orbits, st.tuples(*[st.floats(-1e-3, 1e-3)] * 6).map(np.array))
def test_the_linear_map_leaves_the_square_of_the_separation(chief, direction):
    inertial = state_from_elements(chief)
    errors, e = [], chief.eccentricity
    for size in (1.0, 0.5):
        relative = size * 0.1 * chief.perigee_radius * direction
        error = state_from_osculating(inertial, relative) - hill_matrix(chief) @ relative
        errors.append(np.linalg.norm(error / np.repeat([1.0, chief.mean_motion], 3)))
    most = float(np.linalg.norm(0.1 * chief.perigee_radius * direction))
    assert errors[0] <= 10.0 * most**2 / chief.perigee_radius / (1.0 - e) ** 3 + 1e-5
    assert errors[1] <= 0.26 * errors[0] + 1e-5  # a quarter at half the size


@given(orbits, formations, st.floats(0.0, 3.0))
def test_the_map_and_keplers_transition_are_tschauner_and_hempels(chief, relative, turns):
    duration = turns * chief.period
    model = TschaunerHempelModel.about(chief)
    ahead = elements_after(chief, duration)
    flown = model.transition(0.0, duration) @ hill_matrix(chief) @ relative
    mapped = hill_matrix(ahead) @ kepler_transition(chief, duration) @ relative
    size = np.linalg.norm(relative) * (1.0 + turns) / (1.0 - chief.eccentricity) ** 3
    unit = np.repeat([1.0, chief.mean_motion], 3)
    np.testing.assert_allclose(flown / unit, mapped / unit, atol=1e-8 * size + 1e-9)


def elements_after(orbit, duration):
    anomaly = orbit.mean_anomaly + orbit.mean_motion * duration
    relative = np.array([0.0, (anomaly - orbit.mean_anomaly) * orbit.semi_major_axis, 0.0, 0.0, 0.0, 0.0])
    return deputy_elements(orbit, relative)


@given(formations, st.floats(-10.0, 10.0), st.floats(0.0, 10.0))
def test_the_near_circular_map_is_hills_solution(relative, latitude, angle):
    n = TERRASAR.mean_motion
    relative[0] *= 0.1
    start, end = near_circular_matrix(latitude, n), near_circular_matrix(latitude + angle, n)
    flown = HillModel(n).transition(0.0, angle / n) @ start @ relative
    drifted = kepler_transition(TERRASAR, angle / n) @ relative
    np.testing.assert_allclose(flown, end @ drifted, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(near_circular_elements(latitude + angle, n, flown), drifted, rtol=0.0, atol=1e-8)


@given(orbits)
def test_the_maps_agree_about_a_circular_chief(chief):
    chief = Elements(chief.semi_major_axis, 0.0, chief.inclination, 1.0, 0.0, chief.true_anomaly)
    unit = np.repeat([1.0, chief.mean_motion], 3)[:, None]
    ours = near_circular_matrix(chief.true_anomaly, chief.mean_motion)
    np.testing.assert_allclose(hill_matrix(chief) / unit, ours / unit, atol=1e-12)


@settings(max_examples=10)
@given(orbits, st.tuples(*[st.floats(-1.0, 1.0)] * 6).map(np.array), st.floats(0.0, 10.0))
def test_mean_elements_drift_under_j2_as_the_matrix_says(chief, relative, turns):
    duration, inertial = turns * chief.period, state_from_elements(chief)
    relative = relative * np.array([10.0, 100.0, 100.0, 100.0, 100.0, 100.0])
    mean = mean_elements(chief)
    deputy = state_from_elements(osculating_elements(deputy_elements(mean, relative)))
    truth = relative_elements(
        *(mean_elements(elements_from_state(later(each, duration))) for each in (inertial, deputy))
    )
    ours = j2_transition(mean, duration) @ relative
    # A theory of first order leaves the square of J2 times the phase, and the square of the separation.
    strength = J2 * (EARTH_RADIUS / chief.perigee_radius) ** 2
    size = float(np.linalg.norm(relative))
    second = 30.0 * (1.0 + duration * chief.mean_motion) * size**2 / chief.perigee_radius
    phase = (1.0 + duration * chief.mean_motion) / (1.0 - chief.eccentricity) ** 2
    np.testing.assert_allclose(truth, ours, atol=60.0 * strength**2 * phase * size + second + 1e-5)


@given(orbits, st.floats(0.0, 1e5), st.floats(0.0, 1e5))
def test_transitions_under_j2_form_a_group(chief, first, second):
    node, perigee, anomaly = secular_rates(chief)
    turned = Elements(
        chief.semi_major_axis,
        chief.eccentricity,
        chief.inclination,
        chief.right_ascension + node * first,
        chief.argument_of_perigee + perigee * first,
        chief.true_anomaly + anomaly * first,
    )
    parts = j2_transition(turned, second) @ j2_transition(chief, first)
    whole = j2_transition(chief, first + second)
    np.testing.assert_allclose(parts, whole, rtol=0.0, atol=1e-12 * np.abs(whole).max())


@given(orbits, st.floats(1.0, 1e5))
def test_the_drag_response_is_the_integral_of_the_transition(chief, duration):
    nodes, weights = np.polynomial.legendre.leggauss(20)
    total = np.zeros(6)
    perigee_rate = secular_rates(chief)[1]
    for node, weight in zip(nodes, weights, strict=True):
        begun = 0.5 * duration * (1.0 + node)
        omega = chief.argument_of_perigee + perigee_rate * begun
        kept = 1.0 - chief.eccentricity
        source = np.array([1.0, 0.0, kept * math.cos(omega), kept * math.sin(omega), 0.0, 0.0])
        turned = Elements(
            chief.semi_major_axis,
            chief.eccentricity,
            chief.inclination,
            chief.right_ascension,
            omega,
            chief.true_anomaly,
        )
        total += 0.5 * duration * weight * j2_transition(turned, duration - begun) @ source
    found = drag_response(chief, duration)
    np.testing.assert_allclose(found, total, rtol=0.0, atol=1e-10 * np.abs(total).max())


@given(formations.map(lambda each: each * [0.0, 1.0, 1.0, 1.0, 1.0, 1.0]))
def test_the_least_separation_is_reached_and_never_undercut(relative):
    states = np.array([near_circular_matrix(u, 1e-3) @ relative for u in np.linspace(0.0, math.tau, 721)])
    nearest = float(np.hypot(states[:, 0], states[:, 2]).min())
    size = float(np.abs(relative[2:]).max())
    assert least_separation(relative) <= nearest + 1e-9
    # Half a degree off the nearest point, distances grow by the angle squared, near zero by the angle itself.
    assert nearest - least_separation(relative) <= 0.005 * 2.0 * size + 1e-9


def test_parallel_vectors_keep_the_smaller_of_both():
    parallel = np.array([0.0, 500.0, 0.0, 300.0, 0.0, 400.0])
    assert least_separation(parallel) == pytest.approx(300.0)
    assert least_separation(parallel * [1, 1, 1, 1, 1, -1]) == pytest.approx(300.0)
    assert least_separation(parallel + np.array([20.0, 0, 0, 0, 0, 0])) == pytest.approx(280.0)
    perpendicular = np.array([0.0, 0.0, 300.0, 0.0, 0.0, 400.0])
    assert least_separation(perpendicular) == 0.0
    assert least_separation(np.zeros(6)) == 0.0


@pytest.mark.parametrize("inclination", [0.0, 5e-4, math.pi])
def test_a_chief_without_a_node_is_rejected_by_name(inclination):
    chief = Elements(4.2e7, 0.0, inclination, 0.0, 0.0, 0.0)
    for fails in (
        lambda: relative_elements(chief, chief),
        lambda: deputy_elements(chief, np.zeros(6)),
        lambda: hill_matrix(chief),
    ):
        with pytest.raises(OrbitError, match=r"inclination is .*: relative elements need a node"):
            fails()


@pytest.mark.parametrize(("place", "name"), [(0, "semi_major_axis"), (2, "eccentricity"), (4, "inclination")])
def test_a_deputy_on_no_orbit_is_rejected_by_name(place, name):
    with pytest.raises(OrbitError, match=name):
        deputy_elements(TERRASAR, -2e7 * np.eye(6)[place])
    with pytest.raises(OrbitError, match="finite"):
        deputy_elements(TERRASAR, np.nan * np.eye(6)[place])
