"""What a fault is: fields checked like parameters, and an effect on one part of a satellite."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from formation_gnc.common import LAST_SECOND
from formation_gnc.errors import ParameterError
from formation_gnc.parameters import parameter
from formation_gnc.types import NANOSECONDS

if TYPE_CHECKING:
    from formation_gnc.plant.parameters import DeputyParameters


@dataclass(slots=True)
class Memory:
    """State of an injected fault between ticks."""

    random: np.random.Generator
    """Random numbers of this fault alone."""
    held: Any = None
    """What the fault keeps of the past."""


@dataclass(frozen=True, kw_only=True)
class Fault[S](ABC):
    """A fault of one deputy.

    A subclass states its fields with `parameter`, its detail for people, and its effect on a subject `S`: a
    :class:`~formation_gnc.plant.faults.sensors.Sample`, a :class:`~formation_gnc.plant.faults.thrusters.Firing` or
    a :class:`~formation_gnc.records.Measurement`. Its docstring's first line is its meaning in the reference.
    """

    at: float = parameter(unit="s", minimum=0.0, maximum=LAST_SECOND, doc="time at or after which it begins")
    until: float = parameter(inf, unit="s", above=0.0, maximum=LAST_SECOND, doc="time at or after which it ends")
    deputy: str = parameter(doc="name of the deputy that has it")

    @property
    @abstractmethod
    def words(self) -> str:
        """The fault with its numbers, for people."""

    @abstractmethod
    def alter(self, subject: S, memory: Memory, elapsed: float) -> None:
        """Change a subject while the fault lasts; `elapsed` is the time since it began, s."""

    def watch(self, subject: S, memory: Memory) -> None:  # noqa: B027 - optional
        """See a subject before the fault begins, and after it has ended."""

    def stream(self, name: str) -> str:
        """Name of its stream of random numbers; `name` is its own in the registry."""
        return f"{self.deputy}/faults/{name}"

    def ticks(self, tick_ns: int) -> tuple[int, float]:
        """First tick (of `tick_ns` ns) at which it holds, and the first at which it does no more."""
        end = inf if self.until == inf else -(-round(self.until * NANOSECONDS) // tick_ns)
        return -(-round(self.at * NANOSECONDS) // tick_ns), end

    def check(self, deputy: "DeputyParameters", tick_ns: int) -> None:
        """Check what depends on other fields, on the deputy or on the tick (ns).

        Raises:
            ConfigurationError: a value that is not allowed.
        """
        begin, end = self.ticks(tick_ns)
        if not self.until > self.at:
            raise ParameterError(f"until: {self.until!r} s is not allowed; it must be after at, {self.at!r} s")
        if not end > begin:
            raise ParameterError(
                f"until: {self.until!r} s is not allowed; no tick of {tick_ns / NANOSECONDS:g} s lies between it "
                f"and at, {self.at!r} s"
            )


def amount(numbers: Sequence[float], unit: str = "") -> str:
    """Numbers with their unit, for people."""
    text = ", ".join(f"{number:g}" for number in numbers)
    return f"{text if len(numbers) == 1 else f'[{text}]'} {unit}".rstrip()
