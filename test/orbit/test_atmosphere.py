"""NRLMSIS as the truth's air, against pymsis called for itself."""

import math
import re

import numpy as np
import pymsis
import pytest

from formation_gnc.errors import ConfigurationError, ImpactError
from formation_gnc.orbit.atmosphere import Nrlmsis, geodetic
from formation_gnc.orbit.constants import EARTH_RADIUS, MU
from formation_gnc.orbit.elements import Elements, elements_from_state, state_from_elements
from formation_gnc.orbit.environment import Environment
from formation_gnc.orbit.forces.force import Body
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.propagation import Propagator

from .conftest import about_perigee, fall

EPOCH = 7.9e8
AIR = Forces(drag=True, density_model="nrlmsis", f107=180.0, f107a=160.0, ap=12.0)
BODY = Body()


def place(time: float, position: np.ndarray) -> tuple[np.datetime64, float, float, float]:
    """UTC, longitude and latitude (deg) and altitude (km) on WGS 84, by iteration and the IERS's rotation angle."""
    days = (time - 69.184) / 86400.0
    turn = 2.0 * math.pi * (0.7790572732640 + 1.00273781191135448 * days)
    x, y, z = position
    longitude = math.degrees(math.atan2(y, x) - turn) % 360.0
    across, square = math.hypot(x, y), 0.00669437999014
    latitude = math.atan2(z, across * (1.0 - square))
    for _ in range(20):
        normal = 6378137.0 / math.sqrt(1.0 - square * math.sin(latitude) ** 2)
        latitude = math.atan2(z + square * normal * math.sin(latitude), across)
    altitude = across * math.cos(latitude) + z * math.sin(latitude) - 6378137.0**2 / normal
    moment = np.datetime64("2000-01-01T12:00:00", "ms") + np.timedelta64(round((time - 69.184) * 1e3), "ms")
    return moment, longitude, math.degrees(latitude), altitude / 1e3


def by_pymsis(time: float, position: np.ndarray, flux: tuple[float, float, float] = (180.0, 160.0, 12.0)) -> float:
    """Density, kg/m^3."""
    f107, f107a, ap = flux
    return float(pymsis.calculate(*place(time, position), f107, f107a, [[ap] * 7], version=2.1).ravel()[0])


def density_in_use(propagator: Propagator, time: float, state: np.ndarray) -> float:
    """Density, kg/m^3, from the acceleration by drag."""
    without = Propagator(1.0, 1, Forces(), [BODY], EPOCH).acceleration(time, state)
    brake = propagator.acceleration(time, state) - without
    wind = state[3:] - np.cross([0.0, 0.0, 7.292115e-5], state[:3])
    return float(np.linalg.norm(brake) / (0.5 * 2.2 / 100.0 * np.linalg.norm(wind) ** 2))


@pytest.mark.parametrize("altitude", [150e3, 250e3, 400e3, 600e3])
def test_density_along_an_orbit_is_that_of_pymsis(altitude: float) -> None:
    """Within 0.3 %, for the levels between which it is exponential; the difference of two accelerations rounds."""
    propagator = Propagator(10.0, 1, AIR, [BODY], EPOCH)
    for anomaly in np.linspace(0.0, 2.0 * np.pi, 9):
        state = state_from_elements(Elements(EARTH_RADIUS + altitude + 30e3, 0.0, 1.4, 0.3, 0.2, anomaly))
        time = 1e4 * anomaly
        expected = by_pymsis(EPOCH + time, state[:3])
        rounding = 1e-14 / (0.5 * 2.2 / 100.0 * 7e3**2)
        assert density_in_use(propagator, time, state) == pytest.approx(expected, rel=4e-3, abs=rounding)


def test_geodetic_places_are_those_of_the_ellipsoid() -> None:
    points = np.array([[7e6, 0.0, 0.0], [0.0, 0.0, -6.8e6], [3e6, 4e6, 4.5e6], [2e7, 1e6, -3e7]])
    latitude, altitude = geodetic(points, 6378137.0, 1.0 / 298.257223563)
    for index, point in enumerate(points):
        _, _, degrees, kilometres = place(0.0, point)
        assert np.degrees(latitude[index]) == pytest.approx(degrees, abs=1e-8)
        assert altitude[index] == pytest.approx(1e3 * kilometres, abs=1e-2)


def fallen(forces: Forces, revolutions: int, step: float) -> float:
    """Loss of semi-major axis, m, at 400 km over whole revolutions without J2, which moves it by kilometres."""
    start = Elements(EARTH_RADIUS + 400e3, 0.0, 0.9, 0.3, 0.0, 0.0)
    count = round(revolutions * start.period / step)
    propagator, states = Propagator(start.period * revolutions / count, 1, forces, [BODY], EPOCH), None
    states = state_from_elements(start)[None]
    for k in range(count):
        states = propagator.propagate(k * start.period * revolutions / count, states, np.zeros((1, 3)))
    return start.semi_major_axis - elements_from_state(states[0]).semi_major_axis


def test_decay_follows_the_solar_cycle_as_pymsis_has_it() -> None:
    """Decay is the mean density along the orbit; at 400 km it is thirteen times as fast at a maximum of the Sun."""
    start, cases = Elements(EARTH_RADIUS + 400e3, 0.0, 0.9, 0.3, 0.0, 0.0), ((70.0, 70.0, 4.0), (230.0, 230.0, 15.0))
    falls, means = [], []
    for f107, f107a, ap in cases:
        forces = Forces(zonal_degree=0, drag=True, density_model="nrlmsis", f107=f107, f107a=f107a, ap=ap)
        falls.append(fallen(forces, 1, 30.0))
        densities, anomalies = [], np.linspace(0.0, 2.0 * np.pi, 120, endpoint=False)
        for anomaly in anomalies:
            state = state_from_elements(Elements(start.semi_major_axis, 0.0, 0.9, 0.3, 0.0, anomaly))
            time = EPOCH + anomaly / start.mean_motion
            densities.append(by_pymsis(time, state[:3], (f107, f107a, ap)))
        means.append(float(np.mean(densities)))
    assert falls[1] / falls[0] == pytest.approx(means[1] / means[0], rel=0.01)
    assert 8.0 < falls[1] / falls[0] < 20.0
    wind = 1.0 - 2.0 * 7.292115e-5 * np.cos(0.9) / start.mean_motion  # to first order
    rate = 2.2 / 100.0 * np.sqrt(MU * start.semi_major_axis) * wind * start.period
    assert falls == pytest.approx([rate * mean for mean in means], rel=0.02)


def test_decay_does_not_depend_on_the_step() -> None:
    """The air of mid-step is held: its variation along the track errs by the square of the step."""
    forces = Forces(zonal_degree=0, drag=True, density_model="nrlmsis")
    assert fallen(forces, 1, 60.0) == pytest.approx(fallen(forces, 1, 10.0), rel=2e-3)


def test_substeps_equal_shorter_ticks() -> None:
    states = state_from_elements(Elements(EARTH_RADIUS + 300e3, 0.01, 0.9, 0.3, 0.0, 0.0))[None]
    whole = Propagator(60.0, 6, AIR, [BODY], EPOCH).propagate(0.0, states, np.zeros((1, 3)))
    parts, short = states, Propagator(10.0, 1, AIR, [BODY], EPOCH)
    for k in range(6):
        parts = short.propagate(10.0 * k, parts, np.zeros((1, 3)))
    assert np.array_equal(whole, parts)


def test_bits_do_not_depend_on_what_was_asked_before() -> None:
    """The Fortran of NRLMSIS keeps what it has worked out last."""
    states = state_from_elements(Elements(EARTH_RADIUS + 300e3, 0.01, 0.9, 0.3, 0.0, 0.0))[None]
    propagator = Propagator(10.0, 1, AIR, [BODY], EPOCH)
    first = propagator.propagate(0.0, states, np.zeros((1, 3)))
    Propagator(10.0, 1, Forces(drag=True, density_model="nrlmsis"), [BODY], 0.0).propagate(
        5.0, -states, np.zeros((1, 3))
    )
    pymsis.calculate(np.datetime64("2010-07-01"), 10.0, 20.0, 300.0, 100.0, 100.0, [[4.0] * 7], version=2.0)
    assert np.array_equal(propagator.propagate(0.0, states, np.zeros((1, 3))), first)


@pytest.mark.parametrize("altitude", [150e3, 22e3])
def test_a_dive_through_the_air_of_nrlmsis_ends_alike_at_any_tick(altitude: float) -> None:
    """The end is told at the end of a part of a step, which falls at some 200 m/s."""
    ends = []
    for tick in (10.0, 60.0):
        propagator = Propagator(tick, forces=AIR, bodies=(BODY,), epoch=EPOCH)
        ends.append(fall(propagator, EARTH_RADIUS + altitude, tick))
    assert ends[0][0] == pytest.approx(ends[1][0], abs=120.0)
    assert ends[0][1] == pytest.approx(ends[1][1], abs=2.0)


def test_an_impact_between_two_ticks_is_seen_with_both_models() -> None:
    start = about_perigee(80e3, 900.0)
    assert np.linalg.norm(start[0, :3]) > EARTH_RADIUS + 100e3
    forces = Forces(sun=True, moon=True, drag=True, density_model="nrlmsis", ephemeris="de421")
    with pytest.raises(ImpactError) as raised:
        Propagator(1800.0, 180, forces, [BODY], EPOCH).propagate(0.0, start, np.zeros((1, 3)))
    found = re.search(r"at ([\d.]+) s, latitude", str(raised.value))
    assert found is not None
    assert 300.0 < float(found[1]) < 1800.0


def test_a_state_that_is_not_finite_is_an_impact() -> None:
    with pytest.raises(ImpactError, match="nan"):
        Propagator(10.0, 1, AIR, [BODY], EPOCH).propagate(0.0, np.full((1, 6), np.nan), np.zeros((1, 3)))


def test_a_density_that_is_none_is_rejected() -> None:
    environment = Environment(density=lambda time, latitude, longitude, altitude: -altitude)
    state = state_from_elements(Elements(7e6, 0.0, 0.9, 0.3, 0.0, 0.0))
    with pytest.raises(ConfigurationError, match=r"density model gives -.* it must be finite and not negative"):
        Propagator(10.0, 1, Forces(drag=True), [BODY], EPOCH, environment).acceleration(0.0, state)


def test_indices_are_those_of_the_parameters() -> None:
    assert AIR.environment().density == Nrlmsis(180.0, 160.0, 12.0)
    assert not callable(Forces(density_model="nrlmsis").environment().density)  # without drag


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (
            {"density_model": "jacchia"},
            "density_model: 'jacchia' is not allowed; it must be one of exponential, nrlmsis",
        ),
        ({"ephemeris": "de440"}, "ephemeris: 'de440' is not allowed; it must be one of series, de421"),
        ({"f107": 0.0}, "f107: 0.0 is not allowed"),
        ({"ap": float("nan")}, "ap: nan is not allowed"),
    ],
)
def test_models_that_are_not_known_are_rejected(bad: dict, message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        Propagator(1.0, forces=Forces(**bad))
