"""Density of the air: a table that is exponential in bands of altitude, or a model of place and time.

The compiled drag reads bands. A model is sampled once for each satellite and step: a column over the place where it
will be in mid-step, so that what varies along the track errs by the square of the step.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from math import pi, tau
from typing import Any

import numpy as np
from numpy.typing import NDArray

from formation_gnc.errors import ConfigurationError
from formation_gnc.orbit.sky import TT_MINUS_UT1

Array = NDArray[np.float64]

DensityModel = Callable[[float, Array, Array, Array], Array]
"""Density, kg/m^3, (M,), at a time, s of Terrestrial Time since J2000.0, and places (M,): geodetic latitude and
longitude, rad, and altitude, m."""

DENSITY_MODELS = ("exponential", "nrlmsis")

# Base altitude, km; density there, kg/m^3; scale height, km. Vallado, Fundamentals of Astrodynamics, 8-4:
# US Standard Atmosphere to 25 km, CIRA-72 to 500 km, CIRA-72 with an exospheric temperature of 1000 K above.
_BANDS = np.array(
    [
        (0.0, 1.225, 7.249),
        (25.0, 3.899e-2, 6.349),
        (30.0, 1.774e-2, 6.682),
        (40.0, 3.972e-3, 7.554),
        (50.0, 1.057e-3, 8.382),
        (60.0, 3.206e-4, 7.714),
        (70.0, 8.770e-5, 6.549),
        (80.0, 1.905e-5, 5.799),
        (90.0, 3.396e-6, 5.382),
        (100.0, 5.297e-7, 5.877),
        (110.0, 9.661e-8, 7.263),
        (120.0, 2.438e-8, 9.473),
        (130.0, 8.484e-9, 12.636),
        (140.0, 3.845e-9, 16.149),
        (150.0, 2.070e-9, 22.523),
        (180.0, 5.464e-10, 29.740),
        (200.0, 2.789e-10, 37.105),
        (250.0, 7.248e-11, 45.546),
        (300.0, 2.418e-11, 53.628),
        (350.0, 9.518e-12, 53.298),
        (400.0, 3.725e-12, 58.515),
        (450.0, 1.585e-12, 60.828),
        (500.0, 6.967e-13, 63.822),
        (600.0, 1.454e-13, 71.835),
        (700.0, 3.614e-14, 88.667),
        (800.0, 1.170e-14, 124.64),
        (900.0, 5.245e-15, 181.05),
        (1000.0, 3.019e-15, 268.00),
    ]
)

CIRA = _BANDS * np.array([1e3, 1.0, 1e3])
"""Bands (K, 3): base altitude, m, density there, kg/m^3, scale height, m."""
CIRA.setflags(write=False)

_STEPS = ((0, 150, 2), (150, 300, 5), (300, 1000, 10), (1000, 2001, 50))  # from, to, by, km
LEVELS = 1e3 * np.concatenate([np.arange(*each) for each in _STEPS])
"""Altitudes, m, between which a model's density is taken as exponential: NRLMSIS within 0.3 % from 120 to 1000 km,
and 0.8 % below and above."""


@dataclass(frozen=True)
class Nrlmsis:
    """NRLMSIS 2.1 (Emmert et al. 2022) of the package pymsis, with solar and geomagnetic indices that do not change.

    Raises:
        ConfigurationError: pymsis is not installed.
    """

    f107: float = 150.0
    """Solar flux at 10.7 cm of the day before, sfu."""
    f107a: float = 150.0
    """Its mean over 81 days, sfu."""
    ap: float = 4.0
    """Daily geomagnetic index."""
    tt_minus_ut1: float = TT_MINUS_UT1
    """Terrestrial Time less universal time, s."""

    def __post_init__(self) -> None:
        """Load pymsis."""
        _pymsis()

    def __call__(self, time: float, latitude: Array, longitude: Array, altitude: Array) -> Array:
        """Density as `DensityModel` says."""
        count = len(altitude)
        moment = _J2000 + np.timedelta64(round((time - self.tt_minus_ut1) * 1e3), "ms")
        result = _pymsis().calculate(
            np.full(count, moment),
            np.degrees(longitude),
            np.degrees(latitude),
            1e-3 * altitude,
            np.full(count, self.f107),
            np.full(count, self.f107a),
            np.full((count, 7), self.ap),
        )
        return np.asarray(result[:, 0], dtype=np.float64)


@cache
def _pymsis() -> Any:
    try:
        import pymsis
    except ImportError:
        raise ConfigurationError("pymsis is not installed: pip install pymsis") from None
    return pymsis


_J2000 = np.datetime64("2000-01-01T12:00:00", "ms")


def geodetic(position: Array, radius: float, flattening: float) -> tuple[Array, Array]:
    """Geodetic latitude, rad, and altitude, m, above an ellipsoid (Bowring 1985; within 1e-6 m below 10,000 km).

    Args:
        position: (N, 3), m, z along the polar axis.
        radius: equatorial, m.
        flattening: of the ellipsoid.
    """
    across, up = np.hypot(position[:, 0], position[:, 1]), position[:, 2]
    distance = np.hypot(across, up)
    square = flattening * (2.0 - flattening)  # of the eccentricity
    polar = radius * (1.0 - flattening)
    reduced = np.arctan2(polar * up * (1.0 + square / (1.0 - square) * polar / distance), radius * across)
    latitude = np.arctan2(
        up + square / (1.0 - square) * polar * np.sin(reduced) ** 3, across - square * radius * np.cos(reduced) ** 3
    )
    sine, cosine = np.sin(latitude), np.cos(latitude)
    altitude = across * cosine + up * sine - radius * np.sqrt(1.0 - square * sine * sine)
    return latitude, altitude


def columns(
    model: DensityModel,
    time: float,
    states: Array,
    step: float,
    rotation: Callable[[float], float],
    earth: tuple[float, float, float],
) -> Array:
    """Bands of a model's density over a step, for each satellite: over its place in mid-step, as it coasts.

    Args:
        model: density.
        time: at the start of the step, s of Terrestrial Time since J2000.0.
        states: inertial, at the start, (N, 6), m and m/s.
        step: s; 0 for an instant.
        rotation: Earth rotation angle, rad, at a time, s.
        earth: gravitational parameter, m^3/s^2, equatorial radius, m, and flattening of the ellipsoid.

    Returns:
        (N, K, 3), as `CIRA`, of all altitudes that the satellite can have in the step.

    Raises:
        ConfigurationError: a density that is negative or not finite.
    """
    mu, radius, flattening = earth
    position, velocity = states[:, :3], states[:, 3:]
    with np.errstate(all="ignore"):
        gravity = -mu / np.linalg.norm(position, axis=1)[:, None] ** 3 * position
    middle, end = (position + t * velocity + 0.5 * t * t * gravity for t in (0.5 * step, step))
    if not np.isfinite(end).all():  # the kernel tells it as an impact
        return np.ones((1, 1, 3))
    instant = time + 0.5 * step
    latitude, altitude = geodetic(middle, radius, flattening)
    longitude = np.arctan2(middle[:, 1], middle[:, 0]) - rotation(instant)
    # Bands count from the ellipsoid along the radius, as the compiled drag does.
    along_radius = [_along_radius(each, radius, flattening) for each in (position, middle, end)]
    fall = 0.5 * step * step * mu / radius**2
    lowest, highest = np.min(along_radius, axis=0) - fall, np.max(along_radius, axis=0) + fall
    shift = along_radius[1] - altitude
    first = np.clip(np.searchsorted(LEVELS, lowest - shift, "right") - 1, 0, len(LEVELS) - 2)
    last = np.clip(np.searchsorted(LEVELS, highest - shift, "left"), first + 1, len(LEVELS) - 1)
    count = int((last - first).max()) + 1
    index = np.minimum(first, len(LEVELS) - count)[:, None] + np.arange(count)
    levels = LEVELS[index]
    places = (np.repeat(latitude, count), np.repeat((longitude + pi) % tau - pi, count), levels.ravel())
    air = np.asarray(model(instant, *places), dtype=np.float64).reshape(levels.shape)
    if not (np.isfinite(air) & (air >= 0.0)).all():
        raise ConfigurationError(f"density model gives {air.min()} kg/m^3: it must be finite and not negative")
    bands = np.empty((len(states), count - 1, 3))
    bands[:, :, 0], bands[:, :, 1] = levels[:, :-1] + shift[:, None], air[:, :-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.diff(levels) / np.log(air[:, :-1] / air[:, 1:])
    bands[:, :, 2] = np.where(np.isfinite(scale), scale, np.inf)  # no air, or as much above as below
    return bands


def _along_radius(position: Array, radius: float, flattening: float) -> Array:
    """Altitude of positions (N, 3) as the compiled drag counts it, m."""
    distance = np.linalg.norm(position, axis=1)
    altitude: Array = distance - radius * (1.0 - flattening * (position[:, 2] / distance) ** 2)
    return altitude
