"""Parameters that all nodes of a run share."""

from dataclasses import dataclass
from functools import cached_property
from math import sqrt

from formation_gnc.errors import ConfigurationError, ParameterError
from formation_gnc.orbit.constants import MU
from formation_gnc.orbit.elements import Elements
from formation_gnc.parameters import parameter
from formation_gnc.types import NANOSECONDS
from formation_gnc.units import EPOCH_UNIT

LAST_SECOND = 2**31 - 1
"""Largest time (s) that the stamp of a message holds."""

FIRST_EPOCH, LAST_EPOCH = -1577880000.0, 1577880000.0
"""Years 1950 and 2050, Terrestrial Time since J2000.0, s: where the series of Sun and Moon (`orbit.sky`) hold."""


@dataclass(frozen=True)
class Orbit:
    """Osculating elements of the chief at the start of the run."""

    semi_major_axis: float = parameter(unit="m", above=0.0, maximum=1e9, doc="semi-major axis")
    eccentricity: float = parameter(0.0, minimum=0.0, maximum=0.99, doc="eccentricity")
    inclination: float = parameter(0.0, unit="rad", minimum=0.0, maximum=3.141592653589793, doc="inclination")
    right_ascension: float = parameter(0.0, unit="rad", doc="right ascension of the ascending node")
    argument_of_perigee: float = parameter(0.0, unit="rad", doc="argument of perigee")
    true_anomaly: float = parameter(0.0, unit="rad", doc="true anomaly")


ANY_ORBIT = Orbit(7e6)
"""Placeholder for nodes that do not use the chief's orbit."""


@dataclass(frozen=True)
class CommonParameters:
    """Base of every node's schema; set once in a scenario file, under ``/**``."""

    chief: Orbit
    tick: float = parameter(
        1.0, unit="s", above=0.0, maximum=LAST_SECOND, doc="time between ticks; a whole number of nanoseconds"
    )
    epoch: float = parameter(
        0.0,
        unit=EPOCH_UNIT,
        minimum=FIRST_EPOCH,
        maximum=LAST_EPOCH,
        doc="Terrestrial Time at the start of the run, or a date in UTC, as 2026-11-28T12:00:00Z; it places Sun, Moon "
        "and Greenwich, whose series hold from 1950 to 2050",
    )

    def __post_init__(self) -> None:
        """Raise ParameterError for a tick that is not a whole number of nanoseconds."""
        if abs(self.tick * NANOSECONDS - self.tick_ns) > 1e-3 or self.tick_ns < 1:
            raise ParameterError(
                f"parameter tick: {self.tick!r} is not allowed; it must be a whole number of nanoseconds"
            )

    @cached_property
    def tick_ns(self) -> int:
        """Tick, ns."""
        return round(self.tick * NANOSECONDS)

    @cached_property
    def chief_elements(self) -> Elements:
        """The chief's osculating elements at the start; raises OrbitError for an orbit that cannot be flown."""
        return Elements(**vars(self.chief))

    @cached_property
    def mean_motion(self) -> float:
        """Mean motion of the chief's two-body orbit, rad/s."""
        return sqrt(MU / self.chief.semi_major_axis**3)


def whole_ticks(name: str, duration: float, tick_ns: int) -> int:
    """Ticks of `tick_ns` ns in the duration (s) that a parameter gives.

    Raises:
        ConfigurationError: it is not a whole number of ticks.
    """
    ticks, rest = divmod(round(duration * NANOSECONDS), tick_ns)
    if rest:
        raise ConfigurationError(
            f"parameter {name}: {duration!r} s is not allowed; "
            f"it must be a whole number of ticks of {tick_ns / NANOSECONDS:g} s"
        )
    return ticks
