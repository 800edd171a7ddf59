"""Drag in an atmosphere that turns with the Earth; `formation_gnc.orbit.atmosphere` has its density."""

from math import exp, sqrt

import numpy as np
from numpy.typing import NDArray

from formation_gnc.orbit import sky
from formation_gnc.orbit.atmosphere import CIRA, DENSITY_MODELS
from formation_gnc.orbit.constants import EARTH_RADIUS, EARTH_ROTATION_RATE, FLATTENING
from formation_gnc.orbit.forces.force import Floats, Force, Surroundings, Vector3
from formation_gnc.orbit.jit import inline
from formation_gnc.parameters import parameter


@inline
def density(
    x: float,
    y: float,
    z: float,
    bands: NDArray[np.float64] = CIRA,
    radius: float = EARTH_RADIUS,
    flattening: float = FLATTENING,
) -> float:
    """Density of the atmosphere, kg/m^3, at an inertial position, m, exponential in each band of altitude.

    Altitude is along the radius from the ellipsoid, within 100 m of the geodetic altitude in LEO.
    """
    r = sqrt(x * x + y * y + z * z)
    sine = z / r
    altitude = r - radius * (1.0 - flattening * sine * sine)
    band = 0
    while band + 1 < len(bands) and altitude >= bands[band + 1, 0]:
        band += 1
    result: float = bands[band, 1] * exp((bands[band, 0] - altitude) / bands[band, 2])
    return result


@inline
def _brake(
    density: float,
    area_to_mass: float,
    rotation_rate: float,
    x: float,
    y: float,
    vx: float,
    vy: float,
    vz: float,
) -> Vector3:
    ux, uy, uz = vx + rotation_rate * y, vy - rotation_rate * x, vz
    brake = -0.5 * density * area_to_mass * sqrt(ux * ux + uy * uy + uz * uz)
    return brake * ux, brake * uy, brake * uz


@inline
def acceleration(area_to_mass: float, x: float, y: float, z: float, vx: float, vy: float, vz: float) -> Vector3:
    """Acceleration by drag in the default air, m/s^2; `area_to_mass`, m^2/kg, has the drag coefficient in it."""
    return _brake(density(x, y, z), area_to_mass, EARTH_ROTATION_RATE, x, y, vx, vy, vz)


@inline
def _on_satellite(settings: Floats, coefficient: float, around: Surroundings, state: Floats) -> Vector3:
    x, y, _, vx, vy, vz = state
    return _brake(around.density, coefficient, around.air_rotation_rate, x, y, vx, vy, vz)


DRAG = Force(
    {
        "drag": parameter(False, doc="Drag in an atmosphere that turns with the Earth"),
        "density_model": parameter(
            "exponential",
            choices=DENSITY_MODELS,
            doc="Density of the air: exponential in bands of altitude, the same everywhere and always, or NRLMSIS 2.1",
        ),
        "f107": parameter(
            150.0, unit="sfu", minimum=50.0, maximum=500.0, doc="Solar flux at 10.7 cm of the day before, for nrlmsis"
        ),
        "f107a": parameter(
            150.0, unit="sfu", minimum=50.0, maximum=500.0, doc="Mean solar flux at 10.7 cm over 81 days, for nrlmsis"
        ),
        "ap": parameter(4.0, minimum=0.0, maximum=400.0, doc="Daily geomagnetic index, for nrlmsis"),
    },
    _on_satellite,
    sky.AIR,
    lambda body: body.area * body.drag_coefficient,
)
