"""Compiled ephemerides of Sun and Moon, and the Earth's rotation angle, in the J2000 frame.

Time is in seconds of Terrestrial Time since J2000.0 (2000-01-01 12:00 TT), positions are geocentric. Sun and
Moon are the low-precision series of O. Montenbruck and E. Gill, Satellite Orbits, section 3.3.2, unless tables of
`formation_gnc.orbit.ephemerides` replace them. The Earth's axis is fixed along z of
J2000: precession and nutation (0.14 deg by 2025) are neglected, and universal time is ``TT - 69.184 s``, correct
to a second since 2017 until the next leap second.
"""

from math import cos, floor, pi, sin, tau

import numpy as np
from numpy.typing import NDArray

from formation_gnc.orbit.jit import inline

Array = NDArray[np.float64]
Floats = tuple[float, ...]

ASTRONOMICAL_UNIT = 149597870700.0
"""Metre, IAU 2012."""

SUN, MOON, EARTH_ROTATION, AIR = 1, 2, 4, 8
"""Ephemerides and density of the air, as bits of what a force needs."""

EPHEMERIDES = 8
"""Number of ephemeris values at one time: positions of Sun and Moon (3 each), m, then cosine and sine of the
Earth's rotation angle."""

_CENTURY = 36525.0 * 86400.0
_ARCSECOND = pi / 648000.0
_COS_OBLIQUITY, _SIN_OBLIQUITY = cos(23.43929111 * pi / 180.0), sin(23.43929111 * pi / 180.0)

ROTATION_AT_J2000, ROTATION_EXCESS = 0.7790572732640, 0.00273781191135448
"""Earth rotation angle at 2000-01-01 12:00 UT1, and its rate in a day of UT1 beyond one turn, revolutions (IERS
Conventions 2010, eq. 5.15)."""

TT_MINUS_UT1 = 69.184
"""Terrestrial Time less universal time, s."""

SEGMENT = 2.0 * 86400.0
"""Length of a segment of a table of ephemerides, s; segments are counted from J2000.0."""

NO_TABLE = np.zeros((0, 6, 1))
"""Table of ephemerides without segments: the series."""


@inline
def _turn(revolutions: float) -> float:
    return tau * (revolutions - floor(revolutions))


@inline
def sun(time: float) -> tuple[float, float, float]:
    """Position of the Sun, m: within 0.02 deg from 1950 to 2050."""
    centuries = time / _CENTURY
    anomaly = _turn(0.9931267 + 99.9973583 * centuries)
    centre = (6892.0 * sin(anomaly) + 72.0 * sin(2.0 * anomaly)) * _ARCSECOND
    perigee = 0.7859444 + 0.00089798 * centuries  # its drift is absent from the book's series, 0.16 deg by 2050
    longitude = _turn(perigee) + anomaly + centre
    distance = (149.619 - 2.499 * cos(anomaly) - 0.021 * cos(2.0 * anomaly)) * 1e9
    across = distance * sin(longitude)
    return distance * cos(longitude), across * _COS_OBLIQUITY, across * _SIN_OBLIQUITY


@inline
def moon(time: float) -> tuple[float, float, float]:
    """Position of the Moon, m: within 0.1 deg from 1950 to 2050."""
    centuries = time / _CENTURY
    mean = _turn(0.606433 + 1336.851344 * centuries)  # longitude
    l = _turn(0.374897 + 1325.552410 * centuries)  # noqa: E741  the series' own letters: anomaly of the Moon,
    lp = _turn(0.993133 + 99.997361 * centuries)  # anomaly of the Sun,
    d = _turn(0.827361 + 1236.853086 * centuries)  # elongation,
    f = _turn(0.259086 + 1342.227825 * centuries)  # argument of latitude
    change = (
        22640.0 * sin(l)
        - 4586.0 * sin(l - 2.0 * d)
        + 2370.0 * sin(2.0 * d)
        + 769.0 * sin(2.0 * l)
        - 668.0 * sin(lp)
        - 412.0 * sin(2.0 * f)
        - 212.0 * sin(2.0 * l - 2.0 * d)
        - 206.0 * sin(l + lp - 2.0 * d)
        + 192.0 * sin(l + 2.0 * d)
        - 165.0 * sin(lp - 2.0 * d)
        - 125.0 * sin(d)
        - 110.0 * sin(l + lp)
        + 148.0 * sin(l - lp)
        - 55.0 * sin(2.0 * f - 2.0 * d)
    )
    longitude = mean + change * _ARCSECOND
    argument = f + (change + 412.0 * sin(2.0 * f) + 541.0 * sin(lp)) * _ARCSECOND
    h = f - 2.0 * d
    correction = (
        -526.0 * sin(h)
        + 44.0 * sin(l + h)
        - 31.0 * sin(h - l)
        - 23.0 * sin(lp + h)
        + 11.0 * sin(h - lp)
        - 25.0 * sin(f - 2.0 * l)
        + 21.0 * sin(f - l)
    )
    latitude = (18520.0 * sin(argument) + correction) * _ARCSECOND
    distance = (
        385000.0
        - 20905.0 * cos(l)
        - 3699.0 * cos(2.0 * d - l)
        - 2956.0 * cos(2.0 * d)
        - 570.0 * cos(2.0 * l)
        + 246.0 * cos(2.0 * l - 2.0 * d)
        - 205.0 * cos(lp - 2.0 * d)
        - 171.0 * cos(l + 2.0 * d)
        - 152.0 * cos(l + lp - 2.0 * d)
    ) * 1e3
    x = distance * cos(latitude) * cos(longitude)
    across = distance * cos(latitude) * sin(longitude)
    up = distance * sin(latitude)
    return x, across * _COS_OBLIQUITY - up * _SIN_OBLIQUITY, across * _SIN_OBLIQUITY + up * _COS_OBLIQUITY


@inline
def earth_rotation_angle(
    time: float,
    at_j2000: float = ROTATION_AT_J2000,
    excess: float = ROTATION_EXCESS,
    tt_minus_ut1: float = TT_MINUS_UT1,
) -> float:
    """Angle from the inertial x axis to the prime meridian, rad (IERS Conventions 2010, eq. 5.15)."""
    days = (time - tt_minus_ut1) / 86400.0
    return _turn(at_j2000 + excess * days + (days - floor(days)))


@inline
def _interpolate(table: Array, first: int, time: float, coordinate: int) -> float:
    """Chebyshev polynomial of a coordinate (x, y, z of the Sun, then of the Moon) by Clenshaw's recurrence."""
    segment = int(time // SEGMENT) - first
    segment = max(0, min(len(table) - 1, segment))
    argument = 2.0 * ((time - (first + segment) * SEGMENT) / SEGMENT) - 1.0
    ahead, here = 0.0, 0.0
    for k in range(table.shape[2] - 1, 0, -1):
        ahead, here = here, 2.0 * argument * here - ahead + table[segment, coordinate, k]
    result: float = argument * here - ahead + table[segment, coordinate, 0]
    return result


@inline
def _tabulated(table: Array, first: int, time: float, x: int) -> tuple[float, float, float]:
    """Position, m, whose coordinates in a table begin with number `x`."""
    return (
        _interpolate(table, first, time, x),
        _interpolate(table, first, time, x + 1),
        _interpolate(table, first, time, x + 2),
    )


@inline
def sun_position(time: float, table: Array, first: int) -> tuple[float, float, float]:
    """Position of the Sun, m, by a table (segments, 6, terms) whose first segment is `first`, or by the series."""
    return sun(time) if len(table) == 0 else _tabulated(table, first, time, 0)


@inline
def moon_position(time: float, table: Array, first: int) -> tuple[float, float, float]:
    """Position of the Moon, m; as `sun_position`."""
    return moon(time) if len(table) == 0 else _tabulated(table, first, time, 3)


@inline
def look_up(needed: int, time: float, ephemerides: Array, rotation: Floats, table: Array, first: int) -> None:
    """Fill the `needed` (bits) of the ephemerides at a time, s; the others keep their values.

    `rotation` are the arguments of `earth_rotation_angle` after the time, `table` and `first` those of
    `sun_position`.
    """
    if needed & SUN:
        ephemerides[0], ephemerides[1], ephemerides[2] = sun_position(time, table, first)
    if needed & MOON:
        ephemerides[3], ephemerides[4], ephemerides[5] = moon_position(time, table, first)
    if needed & EARTH_ROTATION:
        angle = earth_rotation_angle(time, *rotation)
        ephemerides[6], ephemerides[7] = cos(angle), sin(angle)
