"""Earth, Sun, Moon and air as arguments: what a user gives is what the forces take."""

import numpy as np
import pytest

from formation_gnc.errors import ConfigurationError, ImpactError
from formation_gnc.orbit.atmosphere import CIRA
from formation_gnc.orbit.constants import EARTH_RADIUS, EARTH_ROTATION_RATE, J2, MU
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.environment import Earth, Environment
from formation_gnc.orbit.forces.force import Body
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.gravity import OBLATENESS, oblate_acceleration, oblate_gradient
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.orbit.sky import moon, sun

LEO = state_from_elements(Elements(6.9e6, 0.01, 0.9, 0.3, 0.4, 0.5))
POINT_MASS = Forces(zonal_degree=0)
ALL = Forces(harmonics_degree=8, sun=True, moon=True, radiation_pressure=True, drag=True)


def accelerations(forces: Forces, environment: Environment, state: np.ndarray = LEO) -> np.ndarray:
    """Acceleration (3,) of a satellite of 100 kg."""
    return Propagator(1.0, 1, forces, [Body()], 7.9e8, environment).acceleration(0.0, state)


def test_the_default_environment_is_that_of_none() -> None:
    thrust = np.zeros((1, 3))
    given = Propagator(10.0, 2, ALL, [Body()], 7.9e8, Environment()).propagate(0.0, LEO[None], thrust)
    assert np.array_equal(given, Propagator(10.0, 2, ALL, [Body()], 7.9e8).propagate(0.0, LEO[None], thrust))


def test_acceleration_of_one_state_is_that_of_the_row() -> None:
    propagator = Propagator(1.0, 1, ALL, [Body()], 7.9e8)
    alone = propagator.acceleration(60.0, LEO, 40.0)
    assert alone.shape == (3,)
    assert np.array_equal(alone, propagator.acceleration(60.0, LEO[None], np.array([40.0]))[0])
    assert np.array_equal(alone, propagator.acceleration(60.0, LEO.tolist(), 40.0))


def test_another_gravitational_parameter_scales_gravity() -> None:
    moon_like = Environment(Earth(mu=4.9e12))
    assert accelerations(POINT_MASS, moon_like) == pytest.approx(-4.9e12 * LEO[:3] / np.linalg.norm(LEO[:3]) ** 3)
    thrice = Environment(Earth(mu=3.0 * MU))
    for forces in (Forces(), Forces(zonal_degree=6), Forces(harmonics_degree=12)):
        assert accelerations(forces, thrice) == pytest.approx(3.0 * accelerations(forces, Environment()), rel=1e-14)


@pytest.mark.parametrize("degree", [2, 6])
def test_zonals_that_are_zero_leave_the_point_mass(degree: int) -> None:
    round_earth = Environment(Earth(zonals=(0.0,) * 5))
    expected = accelerations(POINT_MASS, round_earth)
    assert accelerations(Forces(zonal_degree=degree), round_earth) == pytest.approx(expected, rel=1e-15)


def test_a_field_with_one_coefficient_is_that_zonal_harmonic() -> None:
    cosines = np.zeros((3, 3))
    cosines[0, 0], cosines[2, 0] = 1.0, -J2 / np.sqrt(5.0)
    field = Environment(Earth(cosines=cosines, sines=np.zeros((3, 3))))
    assert accelerations(Forces(harmonics_degree=4), field) == pytest.approx(accelerations(Forces(), field), rel=1e-13)


def test_the_closed_form_of_j2_takes_another_earth_too() -> None:
    other = Environment(Earth(mu=0.9 * MU, zonals=(2.0 * J2, 0.0, 0.0, 0.0, 0.0)))
    mu, oblateness = other.earth.mu, other.earth.oblateness
    assert oblateness == pytest.approx(1.8 * OBLATENESS)
    closed_form = oblate_acceleration(*LEO[:3], mu, oblateness)
    assert closed_form == pytest.approx(accelerations(Forces(), other), rel=1e-15)
    assert oblate_gradient(*LEO[:3], mu, 0.0) == pytest.approx(
        0.9 * np.array(oblate_gradient(*LEO[:3], MU, 0.0)), rel=1e-14
    )


def test_sun_and_moon_can_stand_where_a_test_needs_them() -> None:
    """A body on the x axis pulls along x by 2 mu r / d^3, to first order in r / d = 2e-5 and 7e-3."""
    place = np.array([7e6, 0.0, 0.0, 0.0, 7.5e3, 0.0])
    far, near = np.array([3e11, 0.0, 0.0]), np.array([1e9, 0.0, 0.0])
    still = Environment(sun=lambda _: far, moon=lambda _: near)
    alone = accelerations(POINT_MASS, still, place)
    by_sun = accelerations(Forces(zonal_degree=0, sun=True), still, place) - alone
    by_moon = accelerations(Forces(zonal_degree=0, moon=True), still, place) - alone
    # The difference of 8 m/s^2 rounds at 2e-15.
    assert by_sun == pytest.approx([2.0 * still.mu_sun * 7e6 / 3e11**3, 0.0, 0.0], rel=1e-4, abs=4e-15)
    assert by_moon == pytest.approx([2.0 * still.mu_moon * 7e6 / 1e9**3, 0.0, 0.0], rel=1.5e-2, abs=4e-15)
    propagator = Propagator(1.0, environment=still)
    assert propagator.illumination(0.0, place) == 1.0
    assert propagator.illumination(0.0, -place) == 0.0


def test_tabulated_series_are_the_series() -> None:
    """Polynomials over two days: to rounding of the distances, 3e-5 and 6e-8 m, some tens of times."""
    forces = Forces(sun=True, moon=True)
    tabulated = Environment(sun=lambda time: sun(time), moon=lambda time: moon(time))
    difference = accelerations(forces, tabulated) - accelerations(forces, Environment())
    assert np.abs(difference).max() < 4e-15  # rounding of 8 m/s^2


def test_the_table_of_an_ephemeris_does_not_depend_on_when_a_run_begins() -> None:
    tabulated = Environment(sun=lambda time: sun(time), moon=lambda time: moon(time))
    forces, thrust, later = Forces(sun=True, moon=True), np.zeros((1, 3)), 4 * 86400.0
    early = Propagator(600.0, 60, forces, epoch=7.9e8, environment=tabulated)
    for day in range(5):  # over the ends of segments
        early.propagate(day * 86400.0, LEO[None], thrust)
    late = Propagator(600.0, 60, forces, epoch=7.9e8 + later, environment=tabulated)
    assert np.array_equal(early.propagate(later, LEO[None], thrust), late.propagate(0.0, LEO[None], thrust))


def test_radiation_pressure_scales_with_the_suns_output() -> None:
    forces = Forces(zonal_degree=0, radiation_pressure=True)
    place = np.array([7e6, 0.0, 0.0, 0.0, 7.5e3, 0.0])
    here = Environment(sun=lambda _: np.array([1.5e11, 0.0, 0.0]))
    twice = Environment(sun=here.sun, solar_pressure=2.0 * here.solar_pressure)
    dark = Environment(sun=here.sun, solar_pressure=0.0)
    pushes = [(accelerations(forces, each, place) - accelerations(forces, dark, place))[0] for each in (here, twice)]
    assert pushes[1] == pytest.approx(2.0 * pushes[0], rel=1e-6)  # 6e-8 m/s^2 beside rounding of 2e-15


@pytest.mark.parametrize("as_function", [False, True])
def test_drag_in_air_of_one_density_that_stands_still(as_function: bool) -> None:
    bands = np.array([[0.0, 1e-11, np.inf]])
    density = (lambda time, latitude, longitude, altitude: np.full(len(altitude), 1e-11)) if as_function else bands
    air = Environment(Earth(air_rotation_rate=0.0), density=density)
    brake = accelerations(Forces(drag=True), air) - accelerations(Forces(), air)
    expected = -0.5 * 1e-11 * 2.2 / 100.0 * np.linalg.norm(LEO[3:]) * LEO[3:]
    assert brake == pytest.approx(expected, abs=4e-15)  # rounding of 8 m/s^2


def test_air_that_turns_with_the_satellite_does_not_brake_it() -> None:
    place = np.array([7e6, 0.0, 0.0, 0.0, 7e6 * 1e-3, 0.0])
    air = Environment(Earth(air_rotation_rate=1e-3))
    assert np.array_equal(accelerations(Forces(drag=True), air, place), accelerations(Forces(), air, place))
    assert Earth().air_rotation_rate == EARTH_ROTATION_RATE


def test_a_smaller_earth_is_met_later() -> None:
    state = np.array([[EARTH_RADIUS + 1e3, 0.0, 0.0, -500.0, 7000.0, 0.0]])
    with pytest.raises(ImpactError):
        Propagator(10.0).propagate(0.0, state, np.zeros((1, 3)))
    small = Environment(Earth(radius=EARTH_RADIUS - 100e3))
    assert np.isfinite(Propagator(10.0, environment=small).propagate(0.0, state, np.zeros((1, 3)))).all()


def test_the_earths_rotation_can_be_stopped() -> None:
    still = Earth(rotation_excess=-1.0)
    assert still.rotation_angle(0.0) == pytest.approx(still.rotation_angle(7.9e8 + 1234.5), abs=1e-10)
    later = Earth(tt_minus_ut1=70.184)
    assert later.rotation_angle(7.9e8 + 1.0) == pytest.approx(Earth().rotation_angle(7.9e8), abs=1e-10)


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ({"mu": 0.0}, "mu of the Earth is 0.0: it must be above zero"),
        ({"radius": -1.0}, "radius of the Earth is -1.0"),
        ({"flattening": float("nan")}, "flattening of the Earth is nan: it must be finite"),
        ({"zonals": (1e-3,)}, "must be five, J2 to J6"),
        ({"cosines": np.eye(3)}, "degree n up to 24"),
        ({"cosines": np.eye(30), "sines": np.eye(30)}, "degree n up to 24"),
    ],
)
def test_an_earth_that_is_none_is_rejected(bad: dict, message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        Earth(**bad)


def test_bands_are_those_of_the_published_table() -> None:
    assert CIRA.shape == (28, 3)
    assert CIRA[20] == pytest.approx([400e3, 3.725e-12, 58.515e3])
