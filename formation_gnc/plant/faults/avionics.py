"""Faults of the avionics: what becomes of a measurement besides its readings."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from formation_gnc.orbit.frames import inertial_from_relative
from formation_gnc.parameters import parameter
from formation_gnc.plant.faults.fault import Fault, Memory, amount
from formation_gnc.records import Measurement

NO_FORCE = np.zeros(3)
NO_FORCE.setflags(write=False)


class AvionicsFault(Fault[Measurement]):
    """A fault of the telemetry that the avionics give."""


class TelemetryFreeze(AvionicsFault):
    """A field of the telemetry repeats what it told before; the first value where there was none."""

    field: ClassVar[str]
    """Its name in a measurement."""

    def alter(self, subject: Measurement, memory: Memory, elapsed: float) -> None:
        """Repeat the value held."""
        if memory.held is None:
            self.watch(subject, memory)
        setattr(subject, self.field, memory.held)

    def watch(self, subject: Measurement, memory: Memory) -> None:
        """Hold the last value."""
        memory.held = getattr(subject, self.field)


@dataclass(frozen=True, kw_only=True)
class MassScale(AvionicsFault):
    """The mass is told as a multiple of the true one."""

    factor: float = parameter(above=0.0, maximum=1e6, doc="factor of the mass")

    @property
    def words(self) -> str:
        """With the factor."""
        return f"mass told times {self.factor:g}"

    def alter(self, subject: Measurement, memory: Memory, elapsed: float) -> None:
        """Multiply."""
        subject.mass = self.factor * subject.mass


@dataclass(frozen=True, kw_only=True)
class ForceFreeze(TelemetryFreeze):
    """The applied force told before is repeated; the first one where there was none."""

    field = "applied_force"

    @property
    def words(self) -> str:
        """Of the force."""
        return "applied force told frozen"


@dataclass(frozen=True, kw_only=True)
class ForceZero(AvionicsFault):
    """No applied force is told."""

    @property
    def words(self) -> str:
        """Of the force."""
        return "applied force told as zero"

    def alter(self, subject: Measurement, memory: Memory, elapsed: float) -> None:
        """Tell none."""
        subject.applied_force = NO_FORCE


@dataclass(frozen=True, kw_only=True)
class ChiefFreeze(TelemetryFreeze):
    """The chief's state told before is repeated; the first one where there was none."""

    field = "chief_state"

    @property
    def words(self) -> str:
        """Of the ephemeris."""
        return "chief's ephemeris frozen"


@dataclass(frozen=True, kw_only=True)
class ChiefDrift(AvionicsFault):
    """The chief's state told is that of a point that moves away from the chief, from where it is."""

    rate: tuple[float, ...] = parameter(
        unit="m/s", length=3, minimum=-1e4, maximum=1e4, doc="of the point, in the chief's Hill frame"
    )

    @property
    def words(self) -> str:
        """With the rate."""
        return f"chief's ephemeris drifting by {amount(self.rate, 'm/s')}"

    def alter(self, subject: Measurement, memory: Memory, elapsed: float) -> None:
        """Tell the point's state."""
        rate = np.array(self.rate)
        subject.chief_state = inertial_from_relative(subject.chief_state, np.concatenate([elapsed * rate, rate]))


@dataclass(frozen=True, kw_only=True)
class ChiefJump(AvionicsFault):
    """The chief's state told is that of a point at rest in the chief's Hill frame, off the chief."""

    offset: tuple[float, ...] = parameter(
        unit="m", length=3, minimum=-1e9, maximum=1e9, doc="of the point, in the chief's Hill frame"
    )

    @property
    def words(self) -> str:
        """With the offset."""
        return f"chief's ephemeris off by {amount(self.offset, 'm')}"

    def alter(self, subject: Measurement, memory: Memory, elapsed: float) -> None:
        """Tell the point's state."""
        subject.chief_state = inertial_from_relative(subject.chief_state, np.array([*self.offset, 0.0, 0.0, 0.0]))
