"""What the sensors read, and its derivatives, against finite differences, symmetry and a second
derivation."""

from math import cos, hypot, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.navigation import kernels
from formation_gnc.navigation.measurement import Readings, StateHistory, pseudo_jacobian, pseudo_measurements
from formation_gnc.navigation.process import Interval, NonlinearProcess, substeps
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import (
    hill_transform,
    hill_transform_inverse,
    inertial_from_relative,
    relative_from_inertial,
)
from formation_gnc.orbit.propagation import advance_with_transition
from formation_gnc.plant.sensors import read as truth
from formation_gnc.records import Sensor
from formation_gnc.types import Vector

ALL = np.array([int(sensor) for sensor in Sensor])
AT_REST = np.zeros(3)

chiefs = st.builds(
    lambda a, e, i, node, perigee, nu: state_from_elements(Elements(a, e, i, node, perigee, nu)),
    st.floats(7.2e6, 4.3e7),
    st.floats(0.0, 0.05),
    st.floats(0.0, 1.4),
    st.floats(-3.0, 3.0),
    st.floats(-3.0, 3.0),
    st.floats(-3.0, 3.0),
)
relatives = st.builds(
    lambda place, speed: np.array([*place, *speed]),
    st.tuples(*[st.floats(-5e3, 5e3)] * 3).filter(lambda place: hypot(*place) > 10.0),
    st.tuples(*[st.floats(-5.0, 5.0)] * 3),
)


def readings(chief: Vector, value: Vector, age: float = 0.0, track: StateHistory | None = None) -> Readings:
    ones = np.ones(len(ALL))
    return Readings(ALL, value, age * ones, ones, chief, track or StateHistory(100), age > 0.0)


@given(chiefs, relatives)
def test_expected_readings_are_those_of_the_truth(chief: Vector, relative: Vector) -> None:
    deputy = inertial_from_relative(chief, relative)
    expected, _ = kernels.read_relative(ALL, chief, relative)
    # one rounding of a 7000 to 43000 km coordinate, some roundings on the way
    np.testing.assert_allclose(expected, [truth(sensor, deputy, chief) for sensor in Sensor], rtol=1e-14, atol=3e-8)


@given(chiefs, relatives)
def test_jacobians_are_the_slopes_of_the_readings(chief: Vector, relative: Vector) -> None:
    _, jacobian = kernels.read_relative(ALL, chief, relative)
    steps = np.array([1.0, 1.0, 1.0, 1e-2, 1e-2, 1e-2])
    for column, step in enumerate(steps):
        offset = np.zeros(6)
        offset[column] = step
        above, _ = kernels.read_relative(ALL, chief, relative + offset)
        below, _ = kernels.read_relative(ALL, chief, relative - offset)
        difference = above - below
        difference[3] = (difference[3] + pi) % (2 * pi) - pi  # right ascension has a seam
        slope = difference / (2.0 * step)
        # Rounding of the readings over the step; the curvature of the range.
        scale = np.array([1e-8, 1e-11, 1e-15, 1e-15, 1e-8]) / step + np.array([1e-9, 1e-9, 1e-13, 1e-13, 5e-3])
        np.testing.assert_array_less(np.abs(jacobian[:, column] - slope), scale * 5)


@given(chiefs, relatives, st.floats(-pi, pi))
def test_radius_range_rate_and_latitude_do_not_change_when_the_orbit_is_turned_about_the_earths_axis(
    chief: Vector, relative: Vector, angle: float
) -> None:
    deputy = inertial_from_relative(chief, relative)
    turn = np.array([[cos(angle), -sin(angle), 0.0], [sin(angle), cos(angle), 0.0], [0.0, 0.0, 1.0]])
    turned = np.concatenate([turn @ deputy[:3], turn @ deputy[3:]])
    before, after = (kernels.read(ALL, state, chief)[0] for state in (deputy, turned))
    np.testing.assert_allclose(after[:3], before[:3], rtol=1e-14, atol=1e-11)
    assert after[3] - before[3] == pytest.approx(angle, abs=1e-12) or abs(after[3] - before[3]) > 1.0


@given(chiefs, relatives)
def test_the_kernels_frames_are_those_of_the_package(chief: Vector, relative: Vector) -> None:
    other = kernels.coast(chief, AT_REST, 30.0, 3)
    deputy = inertial_from_relative(chief, relative)
    # 1e-8 m and 1e-11 m/s: a few roundings of the inertial coordinates
    np.testing.assert_allclose(
        kernels.relative_to(chief, relative, other),
        relative_from_inertial(other, deputy),
        rtol=1e-13,
        atol=5e-8,
    )


@given(chiefs, relatives, st.tuples(*[st.floats(-1e-3, 1e-3)] * 3).map(np.array))
def test_a_prediction_is_the_inertial_flight_of_both_satellites(
    chief: Vector, relative: Vector, acceleration: Vector
) -> None:
    tick = 10.0
    later = kernels.coast(chief, AT_REST, tick, 1)
    covariance, noise = np.diag([1.0, 2.0, 3.0, 1e-6, 2e-6, 3e-6]), np.eye(6) * 1e-9
    leg = Interval(chief, later, acceleration, tick, 1)
    state, spread, transition = NonlinearProcess().predict(leg, relative, covariance, noise)
    inertial = acceleration @ np.array([hill_transform(chief)[row, :3] for row in range(3)])
    deputy, flight = advance_with_transition(inertial_from_relative(chief, relative), inertial, tick, 1)
    np.testing.assert_allclose(state, relative_from_inertial(later, deputy), rtol=1e-13, atol=5e-8)
    np.testing.assert_allclose(
        transition, hill_transform(later) @ flight @ hill_transform_inverse(chief), rtol=1e-12, atol=1e-13
    )
    np.testing.assert_allclose(spread, transition @ covariance @ transition.T + noise, rtol=1e-12, atol=1e-15)
    np.testing.assert_array_equal(spread, spread.T)
    (moved,) = kernels.fly_points(chief, later, relative[None], acceleration, tick, 1)
    np.testing.assert_allclose(moved, state, rtol=1e-13, atol=5e-8)


@given(chiefs, relatives, st.floats(0.0, 59.0))
def test_a_late_reading_is_expected_where_the_deputy_was_when_it_was_taken(
    chief: Vector, relative: Vector, age: float
) -> None:
    tick, force = 10.0, np.array([1e-3, -2e-3, 5e-4])
    track, places = StateHistory(6), [(chief, inertial_from_relative(chief, relative))]
    state = relative
    for _ in range(6):
        before = places[-1][0]
        after = kernels.coast(before, AT_REST, tick, 1)
        leg = Interval(before, after, force, tick, 1)
        track.add(leg)
        state, _, _ = NonlinearProcess().predict(leg, state, np.zeros((6, 6)), np.zeros((6, 6)))
        places.append((after, inertial_from_relative(after, state)))
    late = readings(places[-1][0], np.zeros(5), age, track)
    expected, jacobian = late.expected(state)
    index = int((60.0 - age) // tick)
    start, deputy = places[index]
    thrust = force @ hill_transform(start)[:3, :3]
    rest = 60.0 - age - index * tick
    then = kernels.coast(deputy, thrust, rest, substeps(rest))
    chief_then = kernels.coast(start, AT_REST, rest, substeps(rest))
    direct = np.array([truth(sensor, then, chief_then) for sensor in Sensor])
    # Back and forth once: roundings of coordinates of up to 43000 km and of speeds over a minute.
    np.testing.assert_allclose(late.innovation(expected), late.innovation(direct), rtol=0.0, atol=2e-6)
    offset = np.array([1.0, -1.0, 1.0, 1e-2, 1e-2, -1e-2])
    above, below = late.expected(state + offset)[0], late.expected(state - offset)[0]
    difference = above - below
    difference[3] = (difference[3] + pi) % (2 * pi) - pi
    slope = difference / 2.0
    np.testing.assert_allclose(jacobian @ offset, slope, rtol=1e-4, atol=0.3)
    np.testing.assert_allclose((jacobian @ offset)[2:4], slope[2:4], rtol=1e-5, atol=1e-13)


def test_innovations_of_right_ascension_go_the_short_way_round() -> None:
    value = np.array([0.0, 0.0, 0.0, 3.14, 0.0])
    expected = np.array([0.0, 0.0, 0.0, -3.14, 0.0])
    turned = readings(np.zeros(6), value).innovation(expected)
    assert turned[3] == pytest.approx(6.28 - 2.0 * pi)


@given(chiefs, relatives)
def test_pseudo_measurements_are_those_of_neokleous(chief: Vector, relative: Vector) -> None:
    """(3.13), (3.18): functions of the relative state about a circular equatorial chief; exact in general
    as below."""
    expected, _ = kernels.read_relative(ALL, chief, relative)
    radius = float(np.linalg.norm(chief[:3]))
    deputy = inertial_from_relative(chief, relative)
    pseudo = pseudo_measurements(ALL, expected, radius)
    x, y, z = relative[:3]
    # the rounding of a squared radius, 1e15 m^2
    assert pseudo[0] == pytest.approx(2.0 * radius * x + x * x + y * y + z * z, abs=10.0)
    assert pseudo[1] == pytest.approx(deputy[:3] @ deputy[3:], rel=1e-12, abs=1e-2)
    assert pseudo[2] == pytest.approx(deputy[2], abs=1e-7)
    np.testing.assert_array_equal(pseudo[3:], expected[3:])
    slope = pseudo_jacobian(ALL, expected)
    steps = np.array([1.0, 1e-2, 1e-6])
    for column, step in enumerate(steps):
        offset = np.zeros(5)
        offset[column] = step
        difference = pseudo_measurements(ALL, expected + offset, radius) - pseudo_measurements(
            ALL, expected - offset, radius
        )
        np.testing.assert_allclose(difference[:3] / (2 * step), slope[:3, column], rtol=1e-4, atol=0.1)


def test_about_an_equatorial_chief_the_third_pseudo_measurement_is_z() -> None:
    chief = state_from_elements(Elements(42164e3, 0.0, 0.0, 0.0, 0.0, 1.0))
    relative = np.array([100.0, 2000.0, -300.0, 0.1, 0.2, 0.3])
    expected, _ = kernels.read_relative(ALL, chief, relative)
    pseudo = pseudo_measurements(ALL, expected, 42164e3)
    assert pseudo[2] == pytest.approx(-300.0, abs=1e-7)
    # (3.18): (r1 + x) x' + y y' + z z', his relative velocities being those of the turning frame
    assert pseudo[1] == pytest.approx((42164e3 + 100.0) * 0.1 + 2000.0 * 0.2 - 300.0 * 0.3, abs=0.1)


def test_a_sensor_without_a_model_expects_not_a_number() -> None:
    chief = state_from_elements(Elements(42164e3, 0.0, 0.0, 0.0, 0.0, 1.0))
    assert np.isnan(kernels.read(np.array([9]), chief, chief)[0][0])
