"""Measurement functions of all sensors: derivatives by finite differences, geometry, and symmetry."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from formation_gnc.orbit.constants import MU
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import relative_from_inertial
from formation_gnc.sensors.kernels import CODES, measure
from formation_gnc.sensors.registry import sensors
from formation_gnc.sensors.sensor import Sensor
from formation_gnc.types import Matrix, Vector

ALL = list(sensors().values())

CHIEF = np.array([7.0e6, 0.0, 0.0, 0.0, 1000.0, 7400.0])

CENTRAL = (4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0)
"""Central differences of order eight: weights of f(x + k h) - f(x - k h) over h, k from 1."""

orbits = st.builds(
    Elements,
    semi_major_axis=st.floats(8e6, 4e7),
    eccentricity=st.floats(0.0, 0.15),
    inclination=st.floats(0.0, math.pi),
    right_ascension=st.floats(-3.0, 3.0),
    argument_of_perigee=st.floats(-3.0, 3.0),
    true_anomaly=st.floats(-3.0, 3.0),
)
separations = st.builds(
    lambda distance, azimuth, elevation, velocity: np.array(
        [
            distance * math.cos(elevation) * math.cos(azimuth),
            distance * math.cos(elevation) * math.sin(azimuth),
            distance * math.sin(elevation),
            *velocity,
        ]
    ),
    st.floats(100.0, 1e5),
    st.floats(-math.pi, math.pi),
    st.floats(-1.5, 1.5),
    st.tuples(*[st.floats(-10.0, 10.0)] * 3),
)


def value(name: str, deputy: Vector, chief: Vector = CHIEF) -> float:
    (only,) = sensors()[name].measure(deputy.tolist(), chief.tolist())
    return only


def compiled(sensor: Sensor, deputy: Vector, chief: Vector) -> tuple[Vector, Matrix]:
    found: tuple[Vector, Matrix] = measure(np.array([CODES[sensor.name]]), deputy, chief)
    return found


def difference(sensor: Sensor, above: Vector, below: Vector, chief: Vector) -> Vector:
    """Of two readings, angles the short way round."""
    one, other = (np.array(sensor.measure(each.tolist(), chief.tolist())) for each in (above, below))
    out: Vector = one - other
    for place in sensor.angles:
        out[place] = math.remainder(out[place], 2.0 * math.pi)
    return out


@pytest.mark.parametrize("sensor", ALL, ids=lambda sensor: sensor.name)
@given(chief=orbits.map(state_from_elements), separation=separations)
def test_jacobians_are_the_slopes_of_the_readings(sensor: Sensor, chief: Vector, separation: Vector) -> None:
    deputy = chief + separation
    _, jacobian = compiled(sensor, deputy, chief)
    # A hundredth of the nearest place without a direction: order eight leaves (4 / 100)^8 of the derivative.
    axis = math.hypot(deputy[0], deputy[1])
    assume(axis > 1e4)
    normal = np.cross(chief[:3], chief[3:])
    in_plane = float(np.linalg.norm(np.cross(separation[:3], normal / np.linalg.norm(normal))))
    assume(in_plane > 0.05 * np.linalg.norm(separation[:3]))
    distance = min(axis, in_plane)
    steps = np.repeat([distance, np.linalg.norm(deputy[3:])], 3) / 100.0
    # Readings are rounded to a few bits of themselves, and of what coordinates of 40000 km add to them.
    readings = np.abs(sensor.measure(deputy.tolist(), chief.tolist()))
    rounding = 16.0 * np.finfo(float).eps * (readings + np.abs(jacobian) @ np.abs(deputy))
    for column, step in enumerate(steps):
        offset = np.zeros(6)
        offset[column] = step
        slope = sum(
            weight * difference(sensor, deputy + k * offset, deputy - k * offset, chief)
            for k, weight in enumerate(CENTRAL, 1)
        )
        allowed = 1e-10 * np.abs(jacobian * steps).max(axis=1) + rounding
        assert (np.abs(jacobian[:, column] * step - slope) <= allowed).all()


@pytest.mark.parametrize("sensor", ALL, ids=lambda sensor: sensor.name)
@given(chief=orbits.map(state_from_elements), separation=separations)
def test_compiled_readings_are_those_of_python(sensor: Sensor, chief: Vector, separation: Vector) -> None:
    deputy = chief + separation
    readings, jacobian = compiled(sensor, deputy, chief)
    assert jacobian.shape == (sensor.size, 6)
    # a few roundings: see formation_gnc.sensors.norm
    np.testing.assert_allclose(readings, sensor.measure(deputy.tolist(), chief.tolist()), rtol=1e-15, atol=1e-15)


@given(chief=orbits.map(state_from_elements), separation=separations, order=st.permutations(list(CODES)))
def test_readings_together_are_those_of_each_alone(chief: Vector, separation: Vector, order: list[str]) -> None:
    deputy = chief + separation
    readings, jacobian = measure(np.array([CODES[name] for name in order]), deputy, chief)
    alone = [compiled(sensors()[name], deputy, chief) for name in order]
    np.testing.assert_array_equal(readings, np.concatenate([each for each, _ in alone]))
    np.testing.assert_array_equal(jacobian, np.concatenate([each for _, each in alone]))


@given(orbits, st.floats(-math.pi, math.pi))
def test_readings_follow_from_the_elements_of_the_orbit(orbit: Elements, turn: float) -> None:
    state = state_from_elements(orbit)
    parameter = orbit.semi_major_axis * (1.0 - orbit.eccentricity**2)
    radius = parameter / (1.0 + orbit.eccentricity * math.cos(orbit.true_anomaly))
    rate = math.sqrt(MU / parameter) * orbit.eccentricity * math.sin(orbit.true_anomaly)
    argument = orbit.argument_of_perigee + orbit.true_anomaly
    sine = math.sin(orbit.inclination) * math.sin(argument)
    assert value("radius", state) == pytest.approx(radius, rel=1e-14)
    assert value("range_rate", state) == pytest.approx(rate, abs=1e-11)  # rounding at 1e4 m/s
    assert math.sin(value("latitude", state)) == pytest.approx(sine, abs=1e-14)
    node = orbit.right_ascension
    east = math.atan2(math.cos(orbit.inclination) * math.sin(argument), math.cos(argument)) + node
    if abs(sine) < 0.999:
        off = value("right_ascension", state) - east
        assert math.remainder(off, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-13 / (1.0 - sine**2))
    about_axis = turned(turn)
    for name in ("radius", "range_rate", "latitude"):
        assert value(name, about_axis @ state) == pytest.approx(value(name, state), rel=1e-14, abs=1e-11)


def turned(angle: float) -> Any:
    """Turn (6, 6) of a state about the Earth's axis."""
    c, s = math.cos(angle), math.sin(angle)
    return np.kron(np.eye(2), [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@given(orbits, st.floats(-3.0, 3.0))
def test_only_right_ascension_sees_a_turn_about_the_earths_axis(orbit: Elements, angle: float) -> None:
    deputy = state_from_elements(orbit)
    codes = np.array([CODES[name] for name in ("radius", "range_rate", "latitude", "right_ascension")])
    before, after = (measure(codes, state, CHIEF)[0] for state in (deputy, turned(angle) @ deputy))
    np.testing.assert_allclose(after[:3], before[:3], rtol=1e-14, atol=1e-11)
    if math.hypot(deputy[0], deputy[1]) > 1e5:
        assert math.remainder(after[3] - before[3] - angle, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-12)


@given(orbits, orbits)
def test_the_range_to_the_chief_is_the_same_from_either_end(one: Elements, other: Elements) -> None:
    deputy, chief = state_from_elements(one), state_from_elements(other)
    distance = value("chief_range", deputy, chief)
    assert distance == value("chief_range", chief, deputy)
    assert distance == pytest.approx(float(np.linalg.norm(deputy[:3] - chief[:3])), rel=1e-14)


@given(chief=orbits.map(state_from_elements), separation=separations)
def test_relative_sensors_read_the_relative_state(chief: Vector, separation: Vector) -> None:
    deputy = chief + separation
    relative = relative_from_inertial(chief, deputy)
    azimuth, elevation = sensors()["bearing"].measure(deputy.tolist(), chief.tolist())
    distance = value("chief_range", deputy, chief)
    direction = [math.cos(elevation) * math.sin(azimuth), math.cos(elevation) * math.cos(azimuth), math.sin(elevation)]
    # Coordinates of 4e7 m are rounded to 7e-9 m, over distances of 100 m.
    np.testing.assert_allclose(distance * np.array(direction), relative[:3], rtol=1e-13, atol=1e-7)
    names = ("gnss_position", "gnss_velocity")
    position, velocity = (np.array(sensors()[name].measure(deputy.tolist(), chief.tolist())) for name in names)
    np.testing.assert_allclose(np.concatenate([position, velocity]), deputy - chief, rtol=0.0, atol=0.0)
    later = float(np.linalg.norm(position + 1e-3 * velocity)) - float(np.linalg.norm(position - 1e-3 * velocity))
    assert value("chief_range_rate", deputy, chief) == pytest.approx(later / 2e-3, abs=1e-5)


@pytest.mark.parametrize(
    ("name", "deputy"),
    [
        ("latitude", [0.0, 0.0, 7e6, 7e3, 0.0, 0.0]),
        ("right_ascension", [0.0, 0.0, -7e6, 7e3, 0.0, 0.0]),
        ("chief_range", CHIEF.tolist()),
        ("chief_range_rate", CHIEF.tolist()),
        ("bearing", CHIEF.tolist()),
    ],
)
def test_derivatives_without_a_direction_are_not_finite(name: str, deputy: list[float]) -> None:
    _, jacobian = compiled(sensors()[name], np.array(deputy), CHIEF)
    assert not np.isfinite(jacobian).all()
