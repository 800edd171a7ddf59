"""Sun, Moon and the Earth's rotation against a JPL ephemeris and published instants."""

from math import degrees, radians
from pathlib import Path

import numpy as np
import pytest

from formation_gnc.orbit.sky import ASTRONOMICAL_UNIT, earth_rotation_angle, moon, sun

DAY = 86400.0
SERIES = {"sun": sun, "moon": moon}


@pytest.fixture(scope="module")
def ephemeris():
    """DE421 from the package skyfield-data."""
    reason = "comparison with JPL's DE421 needs the verification extras (jplephem, skyfield-data)"
    spk = pytest.importorskip("jplephem.spk", reason=reason)
    data = pytest.importorskip("skyfield_data", reason=reason)
    kernel = spk.SPK.open(Path(data.__file__).parent / "data" / "de421.bsp")
    yield kernel
    kernel.close()


@pytest.mark.parametrize(("body", "angle", "distance"), [("sun", 0.02, 1e-4), ("moon", 0.1, 1.5e-3)])
@pytest.mark.covers(
    "Neokleous (2.19)-(2.23); (2.24)-(2.26)",
    "orbit/sky.py",
    differs="almanac series for the day's Sun and Moon in place of two circles; his (2.25) turns about y for z",
)
def test_directions_agree_with_the_jpl_ephemeris_from_1950_to_2050(ephemeris, body, angle, distance):
    days = np.linspace(-50 * 365.25, 50 * 365.25, 5000)  # 7.3 days apart: all phases of the month
    earth = ephemeris[3, 399].compute(2451545.0 + days)[:3]
    if body == "moon":
        truth = ephemeris[3, 301].compute(2451545.0 + days)[:3] - earth
    else:
        sun_and_earth = ephemeris[0, 10].compute(2451545.0 + days)[:3] - ephemeris[0, 3].compute(2451545.0 + days)[:3]
        truth = sun_and_earth - earth
    ours = np.array([SERIES[body](day * DAY) for day in days]) / 1e3
    apart = np.degrees(np.arctan2(np.linalg.norm(np.cross(ours, truth.T), axis=1), np.sum(ours * truth.T, axis=1)))
    assert apart.max() < angle
    lengths = np.linalg.norm(ours, axis=1) / np.linalg.norm(truth, axis=0)
    assert np.abs(lengths - 1.0).max() < distance


def test_sun_is_on_the_equator_at_the_march_equinox():
    """20 March 2025, 09:01:28 UTC (almanac), of date; J2000 lags by the precession of 25 years, 0.35 deg."""
    time = (9210 - 0.5) * DAY + 9 * 3600 + 88 + 69.184
    x, y, z = sun(time)
    precession = radians(50.29 / 3600 * 25.22)
    longitude = np.arctan2(y * np.cos(radians(23.4393)) + z * np.sin(radians(23.4393)), x)
    assert degrees(longitude + precession) == pytest.approx(0.0, abs=0.02)


def test_distances_are_within_the_almanac_extremes():
    days = np.arange(0.0, 365.25 * 20, 1.0)
    suns = np.array([np.linalg.norm(sun(day * DAY)) for day in days]) / ASTRONOMICAL_UNIT
    assert 0.9832 < suns.min() < 0.9834
    assert 1.0166 < suns.max() < 1.0168
    moons = np.array([np.linalg.norm(moon(day * DAY)) for day in days])
    assert 356.3e6 < moons.min() < 357.5e6  # closest perigee and farthest apogee of the Moon: 356,400, 406,700 km
    assert 406.0e6 < moons.max() < 407.2e6


def test_sun_and_moon_align_at_a_total_eclipse():
    """8 April 2024, 18:17:20 UTC: the axis of the shadow is 0.3431 radii (gamma) from the Earth's centre."""
    time = (8864 - 0.5) * DAY + 18 * 3600 + 17 * 60 + 20 + 69.184
    s, m = np.array(sun(time)), np.array(moon(time))
    distance = np.linalg.norm(np.cross(m, s)) / np.linalg.norm(s) / 6378.137e3
    # 0.1 deg of the Moon are 0.1 Earth radii.
    assert distance == pytest.approx(0.3431, abs=0.1)


def test_earth_rotation_angle_at_j2000_and_a_sidereal_day_later():
    noon = 69.184  # 12:00 UT1
    assert degrees(earth_rotation_angle(noon)) == pytest.approx(280.46061837504, abs=1e-9)
    later = noon + 86164.098903691
    assert degrees(earth_rotation_angle(later)) == pytest.approx(280.46061837504, abs=1e-7)
