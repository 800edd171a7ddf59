"""DE421 as positions of Sun and Moon, against skyfield called for itself."""

from pathlib import Path

import numpy as np
import pytest
import skyfield_data
from skyfield.api import load, load_file

from formation_gnc.errors import ConfigurationError
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.environment import Environment
from formation_gnc.orbit.ephemerides import Ephemerides, de421
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.forces.third_body import MU_MOON, MU_SUN
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.orbit.sky import moon_position, sun_position

DAY = 86400.0
GEO = state_from_elements(Elements(42164e3, 0.0, 0.1, 0.3, 0.2, 0.1))


@pytest.fixture(scope="module")
def jpl():
    """Geocentric positions of Sun and Moon, m, at days of Terrestrial Time since J2000.0."""
    kernel = load_file(str(Path(skyfield_data.__file__).parent / "data" / "de421.bsp"))
    scale = load.timescale(builtin=True)

    def positions(days: np.ndarray) -> list[np.ndarray]:
        time = scale.tt_jd(2451545.0, days)
        return [(kernel[body] - kernel["earth"]).at(time).position.m.T for body in ("sun", "moon")]

    yield positions
    kernel.close()


def test_tables_are_the_ephemeris(jpl) -> None:
    """A polynomial over two days is within 2 cm of the Sun (rounding: 3e-5 m a term) and 1 mm of the Moon."""
    days = np.random.default_rng(1).uniform(-50 * 365.25, 50 * 365.25, 60)
    suns, moons = jpl(days)
    ephemerides = Ephemerides(*de421())
    for day, of_sun, of_moon in zip(days, suns, moons, strict=True):
        table = ephemerides.table(day * DAY, day * DAY)
        assert np.linalg.norm(sun_position(day * DAY, *table) - of_sun) < 0.03
        assert np.linalg.norm(moon_position(day * DAY, *table) - of_moon) < 2e-3


def test_attraction_is_that_of_the_ephemeris(jpl) -> None:
    forces, alone = Forces(zonal_degree=0, sun=True, moon=True, ephemeris="de421"), Forces(zonal_degree=0)
    for day in (-18000.3, 0.0, 9210.4, 18000.7):
        ours = Propagator(1.0, forces=forces, epoch=day * DAY).acceleration(0.0, GEO)
        expected = Propagator(1.0, forces=alone, epoch=day * DAY).acceleration(0.0, GEO)
        for mu, body in zip((MU_SUN, MU_MOON), jpl(np.array([day])), strict=True):
            apart = body[0] - GEO[:3]
            expected = expected + mu * (apart / np.linalg.norm(apart) ** 3 - body[0] / np.linalg.norm(body[0]) ** 3)
        assert ours == pytest.approx(expected, abs=2e-15)  # rounding of mu / d^2, 6e-3 m/s^2, and of gravity


def test_series_err_by_little_of_the_attraction(jpl) -> None:
    """At geosynchronous altitude, 1950 to 2050, against DE421: below 4e-8 m/s^2 of 1.1e-5, the Moon's share."""
    worst = 0.0
    sky = Forces(zonal_degree=0, sun=True, moon=True)
    jpls = Forces(zonal_degree=0, sun=True, moon=True, ephemeris="de421")
    for day in np.linspace(-18250.0, 18250.0, 40):
        ours, truth = (Propagator(1.0, forces=each, epoch=day * DAY).acceleration(0.0, GEO) for each in (sky, jpls))
        worst = max(worst, float(np.linalg.norm(ours - truth)))
    assert 1e-10 < worst < 5e-8


def test_eclipses_see_the_sun_of_the_ephemeris() -> None:
    here = Propagator(1.0, forces=Forces(ephemeris="de421"), epoch=9210 * DAY)
    (x, y, z) = de421()[0](9210 * DAY)
    towards = np.array([x, y, z]) / np.linalg.norm([x, y, z])
    assert here.illumination(0.0, 7e6 * towards) == 1.0
    assert here.illumination(0.0, -7e6 * towards) == 0.0


@pytest.mark.parametrize("epoch", [-3.2e9, 1.7e9, 1e12, 1e300])
def test_an_epoch_outside_of_the_ephemeris_is_rejected(epoch: float) -> None:
    with pytest.raises(ConfigurationError, match="outside of DE421") as raised:
        Propagator(10.0, forces=Forces(sun=True, ephemeris="de421"), epoch=epoch)
    assert "\n" not in str(raised.value)


def test_a_run_that_leaves_the_ephemeris_says_so() -> None:
    propagator = Propagator(10.0, forces=Forces(sun=True, ephemeris="de421"), epoch=1.6e9)
    with pytest.raises(ConfigurationError, match="outside of DE421"):
        propagator.propagate(1e8, GEO[None], np.zeros((1, 3)))


def test_an_environment_takes_functions_of_anyone() -> None:
    sun_at, moon_at = de421()
    forces = Forces(sun=True, moon=True)
    given = Propagator(1.0, forces=forces, environment=Environment(sun=sun_at, moon=moon_at))
    chosen = Propagator(1.0, forces=Forces(sun=True, moon=True, ephemeris="de421"))
    assert np.array_equal(given.acceleration(0.0, GEO), chosen.acceleration(0.0, GEO))
