"""What surrounds the satellites, as data: the Earth, Sun and Moon, and the air.

The compiled forces take every number from here, so that another Earth, ephemeris or atmosphere is an argument of
`formation_gnc.orbit.propagation.Propagator`.
"""

from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import NDArray

from formation_gnc.errors import ConfigurationError
from formation_gnc.orbit import constants, sky
from formation_gnc.orbit.atmosphere import CIRA, DensityModel
from formation_gnc.orbit.ephemerides import Place
from formation_gnc.orbit.forces.drag import density
from formation_gnc.orbit.forces.egm2008 import NORMALISED_C, NORMALISED_S
from formation_gnc.orbit.forces.force import Floats, Surroundings
from formation_gnc.orbit.forces.harmonics import EGM2008, derivatives
from formation_gnc.orbit.forces.radiation import SOLAR_PRESSURE, SUN_RADIUS
from formation_gnc.orbit.forces.third_body import MU_MOON, MU_SUN
from formation_gnc.orbit.jit import inline
from formation_gnc.orbit.sky import AIR, EPHEMERIDES, NO_TABLE, look_up

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Earth:
    """Gravity field, figure and rotation: EGM2008, WGS 84 and IERS 2010 by default.

    Raises:
        ConfigurationError: a value that is not finite, `mu` or `radius` not above zero, or coefficients of another
            shape.
    """

    mu: float = constants.MU
    """Gravitational parameter, m^3/s^2."""
    radius: float = constants.EARTH_RADIUS
    """Equatorial radius, m: of the gravity field, the ellipsoid, the shadow, and the sphere of impacts."""
    flattening: float = constants.FLATTENING
    """Flattening of the ellipsoid from which altitudes count."""
    zonals: tuple[float, ...] = constants.ZONALS
    """J2 to J6, un-normalised: the field of `Forces.zonal_degree`."""
    cosines: Array = field(default_factory=lambda: NORMALISED_C)
    """Fully normalised C_nm, (n + 1, n + 1), by degree and order, C_00 = 1: the field of `Forces.harmonics_degree`."""
    sines: Array = field(default_factory=lambda: NORMALISED_S)
    """Fully normalised S_nm, of the same shape."""
    air_rotation_rate: float = constants.EARTH_ROTATION_RATE
    """Rate at which the air turns about the inertial z axis, rad/s."""
    rotation_at_j2000: float = sky.ROTATION_AT_J2000
    """Earth rotation angle at 2000-01-01 12:00 UT1, revolutions."""
    rotation_excess: float = sky.ROTATION_EXCESS
    """Revolutions in a day of UT1 beyond the first."""
    tt_minus_ut1: float = sky.TT_MINUS_UT1
    """Terrestrial Time less UT1, s."""

    def __post_init__(self) -> None:
        """Check all values."""
        for each in fields(self):
            value = getattr(self, each.name)
            if not np.isfinite(value).all():
                raise ConfigurationError(f"{each.name} of the Earth is {value}: it must be finite")
        for name in ("mu", "radius"):
            if not getattr(self, name) > 0.0:
                raise ConfigurationError(f"{name} of the Earth is {getattr(self, name)}: it must be above zero")
        if len(self.zonals) != len(constants.ZONALS):
            raise ConfigurationError(f"zonals of the Earth are {self.zonals}: they must be five, J2 to J6")
        rows, most = len(self.cosines), len(NORMALISED_C)
        if not self.cosines.shape == self.sines.shape == (rows, rows) or rows > most:
            raise ConfigurationError(
                f"cosines and sines of the Earth are {self.cosines.shape} and {self.sines.shape}: both must be "
                f"(n + 1, n + 1), with a degree n up to {most - 1}"
            )

    @property
    def oblateness(self) -> float:
        """3/2 J2 mu R^2, m^5/s^2."""
        return 1.5 * self.zonals[0] * self.mu * self.radius**2

    @cached_property
    def harmonics(self) -> Array:
        """`formation_gnc.orbit.forces.harmonics.derivatives` of the field."""
        if self.cosines is NORMALISED_C and self.sines is NORMALISED_S:
            return EGM2008
        return derivatives(self.cosines, self.sines)

    def rotation_angle(self, time: float) -> float:
        """Earth rotation angle, rad, at a time, s of Terrestrial Time since J2000.0."""
        return sky.earth_rotation_angle(time, self.rotation_at_j2000, self.rotation_excess, self.tt_minus_ut1)


@dataclass(frozen=True, eq=False)
class Environment:
    """The Earth, Sun and Moon, and the air; `Forces.environment` makes the one that its parameters choose."""

    earth: Earth = field(default_factory=Earth)
    sun: Place = sky.sun
    """Position of the Sun, m, at a time; the series by default, `formation_gnc.orbit.ephemerides.de421` another."""
    moon: Place = sky.moon
    """Position of the Moon, likewise."""
    density: Array | DensityModel = field(default_factory=lambda: CIRA)
    """Bands of altitude, (K, 3): base, m, density there, kg/m^3, and scale height, m; or a model of time and place,
    such as `formation_gnc.orbit.atmosphere.Nrlmsis`."""
    mu_sun: float = MU_SUN
    """Gravitational parameter of the Sun, m^3/s^2."""
    mu_moon: float = MU_MOON
    """Gravitational parameter of the Moon, m^3/s^2."""
    sun_radius: float = SUN_RADIUS
    """Radius of the Sun, m."""
    solar_pressure: float = SOLAR_PRESSURE
    """Pressure of sunlight on an absorbing surface at one astronomical unit, N/m^2."""

    def __post_init__(self) -> None:
        """Check the shape of the bands; raise ConfigurationError for another."""
        if not callable(self.density) and (self.density.ndim != 2 or self.density.shape[1:] != (3,)):
            raise ConfigurationError(f"bands of the density are of shape {self.density.shape}: it must be (K, 3)")

    def packed(self, table: Array = NO_TABLE, first: int = 0, air: Array | None = None) -> Array:
        """The environment in one array, for kernels; unboxing several would take longer than a tick.

        Args:
            table: ephemerides, (segments, 6, terms), as `formation_gnc.orbit.sky.look_up` takes them.
            first: number of the first segment.
            air: bands for each satellite, (N, K, 3); by default those of `density` for all, and none of a model.
        """
        if air is None:
            air = np.ones((1, 1, 3)) if callable(self.density) else np.asarray(self.density, dtype=np.float64)[None]
        earth = self.earth
        by_name = vars(self) | vars(earth) | {"oblateness": earth.oblateness}
        sizes = (*air.shape[:2], table.shape[0], table.shape[2], first)
        rotation = (earth.rotation_at_j2000, earth.rotation_excess, earth.tt_minus_ut1)
        constants = [by_name[name] for name in _CONSTANTS]
        parts = (sizes, rotation, constants, (0.0, 0.0, *earth.zonals), earth.harmonics, air, table)
        return np.concatenate([np.ravel(part) for part in parts])


class Unpacked(NamedTuple):
    """`Environment.packed` in its parts, inside kernels."""

    rotation: Array
    """Arguments of `formation_gnc.orbit.sky.earth_rotation_angle`."""
    constants: Array
    """Those of `Surroundings`."""
    zonals: Array
    harmonics: Array
    air: Array
    table: Array
    first: int


_CONSTANTS = Surroundings._fields[EPHEMERIDES:-1]
_SIZES, _ROTATION, _DEGREES, _FIELD = 5, 3, len(constants.ZONALS) + 2, EGM2008.shape
CONSTANTS = len(_CONSTANTS)

_AT_CONSTANTS = _SIZES + _ROTATION
_AT_ZONALS = _AT_CONSTANTS + CONSTANTS
_AT_HARMONICS = _AT_ZONALS + _DEGREES
_AT_AIR = _AT_HARMONICS + EGM2008.size

_RADIUS, _FLATTENING = _CONSTANTS.index("radius"), _CONSTANTS.index("flattening")
SURFACE = _AT_CONSTANTS + _RADIUS
"""Index of the radius of the surface in `Environment.packed`."""


@inline
def unpack(packed: Array) -> Unpacked:
    """Parts of `Environment.packed`, inside kernels."""
    satellites, bands, segments, terms = int(packed[0]), int(packed[1]), int(packed[2]), int(packed[3])
    at_table = _AT_AIR + satellites * bands * 3
    return Unpacked(
        packed[_SIZES:_AT_CONSTANTS],
        packed[_AT_CONSTANTS:_AT_ZONALS],
        packed[_AT_ZONALS:_AT_HARMONICS],
        packed[_AT_HARMONICS:_AT_AIR].reshape(_FIELD),
        packed[_AT_AIR:at_table].reshape((satellites, bands, 3)),
        packed[at_table:].reshape((segments, 6, terms)),
        int(packed[4]),
    )


@inline
def ephemerides_at(needed: int, time: float, parts: Unpacked, out: Array) -> None:
    """Fill the `needed` (bits) of the ephemerides, (EPHEMERIDES,), at a time, s since J2000.0."""
    look_up(needed, time, out, to_fixed_tuple(parts.rotation, _ROTATION), parts.table, parts.first)


@inline
def surroundings(ephemerides: Array, constants: Floats, needed: int, position: Floats, air: Array) -> Surroundings:
    """Surroundings at an inertial position, m, at the instant of the ephemerides, (EPHEMERIDES,).

    `air` are the bands of the density, (K, 3), which is evaluated when it is needed.
    """
    air_density = 0.0
    if needed & AIR:
        air_density = density(position[0], position[1], position[2], air, constants[_RADIUS], constants[_FLATTENING])
    return Surroundings(*(to_fixed_tuple(ephemerides, EPHEMERIDES) + constants + (air_density,)))
