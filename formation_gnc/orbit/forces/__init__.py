"""The forces on a satellite, each with its switch.

A new perturbation is one new file beside these, its switch in `Forces` and its two lines in `acceleration`.
"""

from dataclasses import dataclass
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from formation_gnc.orbit.forces import drag, harmonics, radiation, third_body, zonal
from formation_gnc.orbit.forces.egm2008 import MAXIMUM_DEGREE
from formation_gnc.orbit.jit import inline
from formation_gnc.orbit.sky import earth_rotation_angle, moon, sun
from formation_gnc.parameters import leaves, parameter


@dataclass(frozen=True)
class Forces:
    """Which forces act, besides the Earth's central attraction and thrust."""

    zonal_degree: int = parameter(
        2,
        minimum=0,
        maximum=6,
        doc="Highest zonal harmonic of the Earth: 2 is J2; below 2, none",
    )
    harmonics_degree: int = parameter(
        0,
        minimum=0,
        maximum=MAXIMUM_DEGREE,
        doc="Degree and order of EGM2008 in place of the zonal harmonics; 0 leaves them in force",
    )
    sun: bool = parameter(False, doc="Attraction of the Sun")
    moon: bool = parameter(False, doc="Attraction of the Moon")
    radiation_pressure: bool = parameter(False, doc="Solar radiation pressure, less the Earth's shadow")
    drag: bool = parameter(False, doc="Drag in an exponential atmosphere that turns with the Earth")

    def switches(self) -> NDArray[np.int64]:
        """The fields in order, as the kernels take them.

        Raises:
            ConfigurationError: a value out of its range.
        """
        return np.array([int(leaf.check(getattr(self, leaf.name))) for leaf in leaves(Forces, {})], dtype=np.int64)


@dataclass(frozen=True)
class Body:
    """What drag and sunlight act on: a sphere."""

    mass: float = parameter(100.0, above=0.0, unit="kg", doc="Mass with full tanks")
    area: float = parameter(1.0, minimum=0.0, unit="m^2", doc="Cross-section, the same from all sides")
    drag_coefficient: float = parameter(2.2, minimum=0.0, doc="Drag coefficient")
    reflectivity: float = parameter(
        1.3,
        minimum=1.0,
        maximum=2.0,
        doc="Radiation pressure coefficient: 1 absorbs all light, 2 reflects it all",
    )


ZONAL_DEGREE, HARMONICS_DEGREE, SUN, MOON, RADIATION_PRESSURE, DRAG = range(6)

SKY = 8
"""How many numbers describe the sky: Sun, Moon, cosine and sine of the Earth's rotation angle."""


@inline
def look_up(on: NDArray[np.int64], time: float, sky: NDArray[np.float64]) -> None:
    """Fill in what the forces in use need to know of the sky at a time, s since J2000.0."""
    if on[SUN] or on[RADIATION_PRESSURE]:
        sky[0], sky[1], sky[2] = sun(time)
    if on[MOON]:
        sky[3], sky[4], sky[5] = moon(time)
    if on[HARMONICS_DEGREE]:
        angle = earth_rotation_angle(time)
        sky[6], sky[7] = cos(angle), sin(angle)


@inline
def _add(a: tuple[float, float, float], b: tuple[float, float, float]) -> tuple[float, float, float]:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inline
def acceleration(
    on: NDArray[np.int64],
    sky: NDArray[np.float64],
    drag_area: float,
    light_area: float,
    x: float,
    y: float,
    z: float,
    vx: float,
    vy: float,
    vz: float,
) -> tuple[float, float, float]:
    """Sum of the forces in use, per unit of mass, m/s^2; areas times coefficients over mass, m^2/kg."""
    if on[HARMONICS_DEGREE] >= 2:
        total = harmonics.acceleration(on[HARMONICS_DEGREE], sky[6], sky[7], x, y, z)
    else:
        total = zonal.acceleration(on[ZONAL_DEGREE], x, y, z)
    if on[SUN]:
        total = _add(total, third_body.acceleration(third_body.MU_SUN, sky[0], sky[1], sky[2], x, y, z))
    if on[MOON]:
        total = _add(total, third_body.acceleration(third_body.MU_MOON, sky[3], sky[4], sky[5], x, y, z))
    if on[RADIATION_PRESSURE]:
        total = _add(total, radiation.acceleration(light_area, sky[0], sky[1], sky[2], x, y, z))
    if on[DRAG]:
        total = _add(total, drag.acceleration(drag_area, x, y, z, vx, vy, vz))
    return total
