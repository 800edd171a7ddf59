"""Declaration of a force, and the body that it acts on."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from formation_gnc.parameters import parameter

Floats = tuple[float, ...]
Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class Body:
    """Mass and surface of a satellite: a sphere, the same from all sides."""

    mass: float = parameter(100.0, above=0.0, unit="kg", doc="Mass with full tanks")
    area: float = parameter(1.0, minimum=0.0, unit="m^2", doc="Cross-section, the same from all sides")
    drag_coefficient: float = parameter(2.2, minimum=0.0, doc="Drag coefficient")
    reflectivity: float = parameter(
        1.3,
        minimum=1.0,
        maximum=2.0,
        doc="Radiation pressure coefficient: 1 absorbs all light, 2 reflects it all",
    )


class Surroundings(NamedTuple):
    """The environment of a satellite at an instant, as compiled forces see it; SI, inertial axes.

    From `formation_gnc.orbit.environment.Environment`.
    """

    sun_x: float
    sun_y: float
    sun_z: float
    moon_x: float
    moon_y: float
    moon_z: float
    cos_turn: float
    sin_turn: float
    """Cosine and sine of the Earth rotation angle."""
    mu: float
    radius: float
    oblateness: float
    """3/2 J2 mu R^2, m^5/s^2."""
    flattening: float
    air_rotation_rate: float
    mu_sun: float
    mu_moon: float
    sun_radius: float
    solar_pressure: float
    density: float
    """Of the air at the satellite, kg/m^3."""


@dataclass(frozen=True)
class Force:
    """A force besides the Earth's gravity and thrust: an entry of the registry.

    `acceleration` is compiled with `formation_gnc.orbit.jit.inline` and runs in the innermost loop. It is called
    with:

    - settings: values of `parameters`, in order, as floats;
    - coefficient: `coefficient` of the satellite over its present mass; 0 for a force without one;
    - surroundings: `Surroundings`, of whose ephemerides and density those in `ephemerides` are valid;
    - state: inertial (x, y, z, vx, vy, vz), m and m/s;

    and returns the acceleration (ax, ay, az), inertial, m/s^2.
    """

    parameters: Mapping[str, Any]
    """Name and declaration (`formation_gnc.parameters.parameter`, with a default) of each parameter, which becomes
    a field of `Forces`. The first is the switch: at zero or false the force does not act."""
    acceleration: Callable[..., Vector3]
    ephemerides: int = 0
    """`SUN`, `MOON`, `EARTH_ROTATION` and `AIR` of `formation_gnc.orbit.sky`, as needed, or-ed."""
    coefficient: Callable[[Body], float] | None = None
    """Property of the satellite that the force is proportional to, if any."""
