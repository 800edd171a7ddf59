"""What every node of a run is told alike."""

from dataclasses import dataclass
from functools import cached_property
from math import sqrt

from formation_gnc.errors import ConfigurationError
from formation_gnc.orbit.constants import MU
from formation_gnc.parameters import parameter
from formation_gnc.types import NANOSECONDS

LAST_SECOND = 2**31 - 1
"""Largest time (s) that a message's stamp can carry."""


@dataclass(frozen=True)
class Orbit:
    """The chief's osculating elements at the start of the run."""

    semi_major_axis: float = parameter(unit="m", above=0.0, maximum=1e9, doc="semi-major axis")
    eccentricity: float = parameter(0.0, minimum=0.0, maximum=0.99, doc="eccentricity")
    inclination: float = parameter(0.0, unit="rad", minimum=0.0, maximum=3.141592653589793, doc="inclination")
    right_ascension: float = parameter(0.0, unit="rad", doc="right ascension of the ascending node")
    argument_of_perigee: float = parameter(0.0, unit="rad", doc="argument of perigee")
    true_anomaly: float = parameter(0.0, unit="rad", doc="true anomaly")


ANY_ORBIT = Orbit(7e6)
"""For nodes that do not depend on the chief, of which every scenario's file tells all."""


@dataclass(frozen=True)
class CommonParameters:
    """Base of every node's schema; in a scenario file it stands once, under ``/**``."""

    chief: Orbit
    tick: float = parameter(
        1.0, unit="s", above=0.0, maximum=LAST_SECOND, doc="time between ticks; a whole number of nanoseconds"
    )
    epoch: float = parameter(
        0.0,
        unit="s",
        doc="Terrestrial Time at the start of the run since J2000.0; it places Sun, Moon and Greenwich",
    )

    def __post_init__(self) -> None:
        """Raise ConfigurationError for a tick that nanosecond stamps cannot carry exactly."""
        if abs(self.tick * NANOSECONDS - self.tick_ns) > 1e-3 or self.tick_ns < 1:
            raise ConfigurationError(
                f"parameter tick: {self.tick!r} is not allowed; it must be a whole number of nanoseconds"
            )

    @cached_property
    def tick_ns(self) -> int:
        """The tick in nanoseconds."""
        return round(self.tick * NANOSECONDS)

    @cached_property
    def mean_motion(self) -> float:
        """Mean motion of the chief's two-body orbit, rad/s."""
        return sqrt(MU / self.chief.semi_major_axis**3)
