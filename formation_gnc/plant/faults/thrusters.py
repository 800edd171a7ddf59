"""Faults of thrusters: what becomes of the force that the valves are set to."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from formation_gnc.errors import ParameterError
from formation_gnc.parameters import parameter
from formation_gnc.plant.faults.fault import Fault, Memory, amount
from formation_gnc.plant.thrusters import NO_FORCE, lagged, rotation_about
from formation_gnc.types import Matrix

if TYPE_CHECKING:
    from formation_gnc.plant.parameters import DeputyParameters

LARGEST_FORCE = 1e3
"""Beyond any thruster of a satellite in formation, N."""


@dataclass(slots=True)
class Firing:
    """Forces of a deputy's thrusters over a tick, before the propellant is counted; Hill frame, N."""

    axes: list[float]
    """Of the thruster of each axis, (3,), before it is turned."""
    tick: float
    """Duration, s."""
    leak: Sequence[float] | None = None
    """Of what leaves beside the thrusters, (3,); None for nothing."""
    rotation: Matrix | None = None
    """Of the thrusters' forces, (3, 3), beyond their mounting error; None for none."""


@dataclass(frozen=True, kw_only=True)
class ThrusterFault(Fault[Firing]):
    """A fault of the thrusters."""

    told: bool = parameter(
        True, doc="whether the applied force in measurements is the true one, or the one there would be without it"
    )

    @property
    def suffix(self) -> str:
        """End of its words."""
        return f", {'' if self.told else 'not '}told"


@dataclass(frozen=True, kw_only=True)
class StuckOn(ThrusterFault):
    """Thrusters give a force whatever is commanded, in eclipse too, while there is propellant."""

    force: tuple[float, ...] = parameter(
        unit="N", length=3, minimum=-LARGEST_FORCE, maximum=LARGEST_FORCE, doc="of each axis; zero where not stuck"
    )
    axes: tuple[bool, ...] = parameter((True, True, True), length=3, doc="axes whose thruster is stuck")

    @property
    def words(self) -> str:
        """With the forces."""
        stuck = (f"{axis} at {self.force[i]:g} N" for i, axis in enumerate("xyz") if self.axes[i])
        return f"thrusters stuck on: {', '.join(stuck)}{self.suffix}"

    def check(self, deputy: "DeputyParameters", tick_ns: int) -> None:
        """As `Fault.check`, with the axes."""
        super().check(deputy, tick_ns)
        _require_axis(self.axes)
        if any(force and not axis for force, axis in zip(self.force, self.axes, strict=True)):
            raise ParameterError(
                f"force: {list(self.force)} is not allowed; it must be 0 on axes that are not stuck, axes are "
                f"{list(self.axes)}"
            )

    def alter(self, subject: Firing, memory: Memory, elapsed: float) -> None:
        """Set the forces."""
        subject.axes = _chosen(self.axes, self.force, subject.axes)


@dataclass(frozen=True, kw_only=True)
class StuckOff(ThrusterFault):
    """Thrusters give no force."""

    axes: tuple[bool, ...] = parameter((True, True, True), length=3, doc="axes whose thruster is stuck")

    @property
    def words(self) -> str:
        """With the axes."""
        stuck = (axis for axis, is_stuck in zip("xyz", self.axes, strict=True) if is_stuck)
        return f"thrusters stuck off: {', '.join(stuck)}{self.suffix}"

    def check(self, deputy: "DeputyParameters", tick_ns: int) -> None:
        """As `Fault.check`, with the axes."""
        super().check(deputy, tick_ns)
        _require_axis(self.axes)

    def alter(self, subject: Firing, memory: Memory, elapsed: float) -> None:
        """Take the forces away."""
        subject.axes = _chosen(self.axes, NO_FORCE, subject.axes)


@dataclass(frozen=True, kw_only=True)
class ThrustScale(ThrusterFault):
    """Forces are multiplied, and the propellant that they use with them."""

    factor: tuple[float, ...] = parameter(
        length=3, minimum=-1e3, maximum=1e3, doc="of each axis; below zero where the sign is wrong"
    )

    @property
    def words(self) -> str:
        """With the factors."""
        return f"thrust times {amount(self.factor)}{self.suffix}"

    def alter(self, subject: Firing, memory: Memory, elapsed: float) -> None:
        """Multiply."""
        subject.axes = [factor * force for factor, force in zip(self.factor, subject.axes, strict=True)]


@dataclass(frozen=True, kw_only=True)
class Misalignment(ThrusterFault):
    """The thrusters' forces are turned, beyond the mounting error."""

    rotation: tuple[float, ...] = parameter(
        unit="rad", length=3, minimum=-4.0, maximum=4.0, doc="about the Hill axes: axis times angle"
    )

    @property
    def words(self) -> str:
        """With the rotation."""
        return f"thrust turned by {amount(self.rotation, 'rad')}{self.suffix}"

    def alter(self, subject: Firing, memory: Memory, elapsed: float) -> None:
        """Turn."""
        more = rotation_about(np.array(self.rotation))
        subject.rotation = more if subject.rotation is None else more @ subject.rotation


@dataclass(frozen=True, kw_only=True)
class Leak(ThrusterFault):
    """Propellant leaves with a constant small force, while there is some."""

    force: tuple[float, ...] = parameter(
        unit="N", length=3, minimum=-LARGEST_FORCE, maximum=LARGEST_FORCE, doc="Hill frame"
    )

    @property
    def words(self) -> str:
        """With the force."""
        return f"leak of {amount(self.force, 'N')}{self.suffix}"

    def alter(self, subject: Firing, memory: Memory, elapsed: float) -> None:
        """Leak."""
        before = subject.leak or NO_FORCE
        subject.leak = [one + more for one, more in zip(before, self.force, strict=True)]


@dataclass(frozen=True, kw_only=True)
class Slow(ThrusterFault):
    """Forces follow with a first-order lag, beyond the thrusters' own."""

    lag: float = parameter(unit="s", above=0.0, maximum=1e9, doc="time constant")

    @property
    def words(self) -> str:
        """With the time constant."""
        return f"thrust lagging by {self.lag:g} s{self.suffix}"

    def alter(self, subject: Firing, memory: Memory, elapsed: float) -> None:
        """Give the mean over the tick, and hold the force at its end."""
        before = memory.held or NO_FORCE
        subject.axes, memory.held = lagged(before, subject.axes, self.lag, subject.tick)

    def watch(self, subject: Firing, memory: Memory) -> None:
        """Hold the force that it begins from."""
        x, y, z = subject.axes
        memory.held = x, y, z


def _require_axis(axes: tuple[bool, ...]) -> None:
    if not any(axes):
        raise ParameterError(f"axes: {list(axes)} is not allowed; at least one must be true")


def _chosen(axes: tuple[bool, ...], there: tuple[float, ...], elsewhere: list[float]) -> list[float]:
    return [one if axis else other for axis, one, other in zip(axes, there, elsewhere, strict=True)]
