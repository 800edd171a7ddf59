"""Expected readings and predictions of the filter, against inertial motion and finite differences."""

from math import hypot, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.navigation.kernels import motion
from formation_gnc.navigation.kernels.measurement import measure_relative
from formation_gnc.navigation.measurement import Readings, measurement_model
from formation_gnc.navigation.process import Interval, NonlinearProcess, substeps
from formation_gnc.navigation.pseudo_measurements import pseudo_jacobian, pseudo_measurements
from formation_gnc.navigation.state_history import StateHistory
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import (
    hill_transform,
    hill_transform_inverse,
    inertial_from_relative,
    relative_from_inertial,
)
from formation_gnc.orbit.propagation import propagate_with_transition
from formation_gnc.sensors.kernels import measure
from formation_gnc.sensors.registry import sensors
from formation_gnc.types import Vector

ALL = measurement_model(tuple(sensors()))
FIVE = measurement_model(("radius", "range_rate", "latitude", "right_ascension", "chief_range"))
NO_ACCELERATION = np.zeros(3)

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


def truth(deputy: Vector, chief: Vector) -> Vector:
    """Readings of all sensors without noise, as the plant has them."""
    return np.concatenate([each.measure(deputy.tolist(), chief.tolist()) for each in sensors().values()])


def readings(chief: Vector, values: Vector, age: float = 0.0, history: StateHistory | None = None) -> Readings:
    ages = [age] * len(ALL.sensors)
    return Readings(ALL, values, ages, np.ones(ALL.size), chief, history or StateHistory(100), age > 0.0)


@given(chiefs, relatives)
def test_expected_readings_are_those_of_the_truth(chief: Vector, relative: Vector) -> None:
    expected, _ = measure_relative(ALL.codes, chief, relative)
    exact = truth(inertial_from_relative(chief, relative), chief)
    first = dict(
        zip(ALL.sensors, np.cumsum([0, *(sensors()[name].size for name in ALL.sensors)]).tolist(), strict=False)
    )
    # One rounding of a 7000 to 43000 km coordinate, some roundings on the way: 3e-8 of each unit, and of an azimuth the
    # more, the nearer the deputy is to the axis about which it is counted.
    tolerance = 3e-8 + 1e-14 * np.abs(exact)
    tolerance[first["bearing"]] += 3e-8 / max(hypot(relative[0], relative[1]), 1e-12)
    difference = expected - exact
    angles = [first[name] + place for name in ALL.sensors for place in sensors()[name].angles]
    difference[angles] = np.remainder(difference[angles] + pi, 2.0 * pi) - pi
    np.testing.assert_array_less(np.abs(difference), tolerance)


@given(chiefs, relatives)
def test_relative_jacobians_are_inertial_ones_in_the_hill_frame(chief: Vector, relative: Vector) -> None:
    _, jacobian = measure_relative(FIVE.codes, chief, relative)
    _, inertial = measure(FIVE.codes, inertial_from_relative(chief, relative), chief)
    expected = inertial @ hill_transform_inverse(chief)
    # Roundings of the inertial coordinates turn the direction from the chief, which mixes the components of a vector.
    turn = 4.0 * np.spacing(np.linalg.norm(chief[:3])) / np.linalg.norm(relative[:3])
    scale = (np.abs(inertial) @ np.abs(hill_transform_inverse(chief))).reshape(-1, 2, 3).max(axis=2)
    tolerance = np.repeat((1e-9 + turn) * scale, 3, axis=1) + 1e-18
    np.testing.assert_array_less(np.abs(jacobian - expected), tolerance)


@given(chiefs, relatives)
def test_change_of_chief_keeps_the_deputy_where_it_is(chief: Vector, relative: Vector) -> None:
    other = motion.coast(chief, NO_ACCELERATION, 30.0, 3)
    deputy = inertial_from_relative(chief, relative)
    # 1e-8 m and 1e-11 m/s: a few roundings of the inertial coordinates
    np.testing.assert_allclose(
        motion.change_chief(chief, relative, other),
        relative_from_inertial(other, deputy),
        rtol=1e-13,
        atol=5e-8,
    )


@given(chiefs, relatives, st.tuples(*[st.floats(-1e-3, 1e-3)] * 3).map(np.array))
def test_predictions_are_the_inertial_motion_of_both_satellites(
    chief: Vector, relative: Vector, acceleration: Vector
) -> None:
    tick = 10.0
    later = motion.coast(chief, NO_ACCELERATION, tick, 1)
    covariance, noise = np.diag([1.0, 2.0, 3.0, 1e-6, 2e-6, 3e-6]), np.eye(6) * 1e-9
    interval = Interval(chief, later, acceleration, tick, 1)
    state, predicted, transition = NonlinearProcess().predict(interval, relative, covariance, noise)
    inertial = acceleration @ np.array([hill_transform(chief)[row, :3] for row in range(3)])
    deputy, step = propagate_with_transition(inertial_from_relative(chief, relative), inertial, tick, 1)
    np.testing.assert_allclose(state, relative_from_inertial(later, deputy), rtol=1e-13, atol=5e-8)
    np.testing.assert_allclose(
        transition, hill_transform(later) @ step @ hill_transform_inverse(chief), rtol=1e-12, atol=1e-13
    )
    np.testing.assert_allclose(predicted, transition @ covariance @ transition.T + noise, rtol=1e-12, atol=1e-15)
    np.testing.assert_array_equal(predicted, predicted.T)
    (moved,) = motion.propagate_points(chief, later, relative[None], acceleration, tick, 1)
    np.testing.assert_allclose(moved, state, rtol=1e-13, atol=5e-8)


@given(chiefs, relatives, st.floats(0.0, 59.0))
def test_late_readings_are_expected_at_the_time_they_were_taken(chief: Vector, relative: Vector, age: float) -> None:
    tick, force = 10.0, np.array([1e-3, -2e-3, 5e-4])
    history, places = StateHistory(6), [(chief, inertial_from_relative(chief, relative))]
    state = relative
    for _ in range(6):
        before = places[-1][0]
        after = motion.coast(before, NO_ACCELERATION, tick, 1)
        interval = Interval(before, after, force, tick, 1)
        history.add(interval)
        state, _, _ = NonlinearProcess().predict(interval, state, np.zeros((6, 6)), np.zeros((6, 6)))
        places.append((after, inertial_from_relative(after, state)))
    late = readings(places[-1][0], np.zeros(ALL.size), age, history)
    expected, jacobian = late.expected(state)
    index = int((60.0 - age) // tick)
    start, deputy = places[index]
    thrust = force @ hill_transform(start)[:3, :3]
    rest = 60.0 - age - index * tick
    then = motion.coast(deputy, thrust, rest, substeps(rest))
    chief_then = motion.coast(start, NO_ACCELERATION, rest, substeps(rest))
    # Back and forth once: roundings of coordinates of up to 43000 km and of speeds over a minute.
    direct = late.innovation(truth(then, chief_then))
    np.testing.assert_allclose(late.innovation(expected), direct, rtol=0.0, atol=2e-6)
    offset = np.array([1.0, -1.0, 1.0, 1e-2, 1e-2, -1e-2])
    above, below = late.expected(state + offset)[0], late.expected(state - offset)[0]
    difference = readings(chief, above).innovation(below)
    slope = difference / 2.0
    np.testing.assert_allclose(jacobian @ offset, slope, rtol=1e-4, atol=0.3)
    np.testing.assert_allclose((jacobian @ offset)[2:4], slope[2:4], rtol=1e-5, atol=1e-13)


def test_innovations_of_right_ascension_go_the_short_way_round() -> None:
    model = measurement_model(("radius", "right_ascension"))
    value = Readings(model, np.array([0.0, 3.14]), [0.0] * 2, np.ones(2), np.zeros(6), StateHistory(1), False)
    turned = value.innovation(np.array([0.0, -3.14]))
    assert turned.tolist() == pytest.approx([0.0, 6.28 - 2.0 * pi])


def test_selected_readings_keep_their_values_ages_and_variances() -> None:
    model = measurement_model(("radius", "latitude", "chief_range"))
    three = Readings(model, np.arange(3.0), [0.0, 1.0, 2.0], np.arange(3.0) + 10.0, np.zeros(6), StateHistory(1), True)
    two = three.select([True, False, True])
    assert two.model.sensors == ("radius", "chief_range")
    assert (two.values.tolist(), list(two.ages), two.variance.tolist()) == ([0.0, 2.0], [0.0, 2.0], [10.0, 12.0])


@given(chiefs, relatives)
@pytest.mark.covers(
    "Neokleous (3.12), (3.13)",
    "navigation/pseudo_measurements.py",
    differs="y(2) is half the rate of r², y(3) is z only about an equatorial chief",
)
def test_pseudo_measurements_are_those_of_neokleous(chief: Vector, relative: Vector) -> None:
    """(3.13), (3.18): functions of the relative state about a circular equatorial chief; exact in general
    as below."""
    expected, _ = measure_relative(FIVE.codes, chief, relative)
    radius = float(np.linalg.norm(chief[:3]))
    deputy = inertial_from_relative(chief, relative)
    pseudo = pseudo_measurements(FIVE, expected, radius)
    x, y, z = relative[:3]
    # the rounding of a squared radius, 1e15 m^2
    assert pseudo[0] == pytest.approx(2.0 * radius * x + x * x + y * y + z * z, abs=10.0)
    assert pseudo[1] == pytest.approx(deputy[:3] @ deputy[3:], rel=1e-12, abs=1e-2)
    assert pseudo[2] == pytest.approx(deputy[2], abs=1e-7)
    np.testing.assert_array_equal(pseudo[3:], expected[3:])
    slope = pseudo_jacobian(FIVE, expected)
    steps = np.array([1.0, 1e-2, 1e-6])
    for column, step in enumerate(steps):
        offset = np.zeros(5)
        offset[column] = step
        difference = pseudo_measurements(FIVE, expected + offset, radius) - pseudo_measurements(
            FIVE, expected - offset, radius
        )
        np.testing.assert_allclose(difference[:3] / (2 * step), slope[:3, column], rtol=1e-4, atol=0.1)


def test_third_pseudo_measurement_about_an_equatorial_chief_is_z() -> None:
    chief = state_from_elements(Elements(42164e3, 0.0, 0.0, 0.0, 0.0, 1.0))
    relative = np.array([100.0, 2000.0, -300.0, 0.1, 0.2, 0.3])
    expected, _ = measure_relative(FIVE.codes, chief, relative)
    pseudo = pseudo_measurements(FIVE, expected, 42164e3)
    assert pseudo[2] == pytest.approx(-300.0, abs=1e-7)
    # (3.18): (r1 + x) x' + y y' + z z', his relative velocities being those of the turning frame
    assert pseudo[1] == pytest.approx((42164e3 + 100.0) * 0.1 + 2000.0 * 0.2 - 300.0 * 0.3, abs=0.1)
