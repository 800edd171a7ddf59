"""Injection of planned faults: which hold at a tick, and what they do to each deputy."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from math import inf
from typing import Any

import numpy as np

from formation_gnc.plant.faults.avionics import AvionicsFault
from formation_gnc.plant.faults.fault import Memory
from formation_gnc.plant.faults.plan import PlannedFault
from formation_gnc.plant.faults.sensors import Sample, SensorFault
from formation_gnc.plant.faults.thrusters import Firing, ThrusterFault
from formation_gnc.plant.thrusters import NO_FORCE, Denial, Thruster, ThrusterState
from formation_gnc.randomness import generator
from formation_gnc.records import Event, EventKind, Measurement
from formation_gnc.types import NANOSECONDS, Vector


class Injection:
    """A planned fault in flight, with its state."""

    def __init__(self, planned: PlannedFault, seed: int, number: int) -> None:
        """Prepare it.

        Args:
            planned: the fault.
            seed: of the run.
            number: of faults of the same stream of random numbers before it.
        """
        self.planned, self.fault = planned, planned.fault
        stream = f"{self.fault.stream(planned.name)}/{number}"
        self.memory, self.told = Memory(generator(seed, stream)), Memory(generator(seed, stream))
        """State, and the one of what is told of the same part, where that differs."""
        self.active = False
        self._since = 0

    def update(self, tick: int, time: int) -> Event | None:
        """Begin or end it where the plan says so; returns the event of that."""
        holds = self.planned.begin <= tick < self.planned.end
        if holds == self.active:
            return None
        self._since = time
        return self._switch(tick, time)

    def withdraw(self, tick: int, time: int) -> Event | None:
        """End it, if it holds; returns the event of that."""
        return self._switch(tick, time) if self.active else None

    def act(self, subject: Any, time: int, memory: Memory) -> None:
        """Let it change a subject while it holds, and see it otherwise."""
        if self.active:
            self.fault.alter(subject, memory, (time - self._since) / NANOSECONDS)
        else:
            self.fault.watch(subject, memory)

    def _switch(self, tick: int, time: int) -> Event:
        self.active = not self.active
        until = f", until {self.fault.until:g} s" if self.active and self.fault.until < inf else ""
        detail = f"{'begins' if self.active else 'ends'}: {self.fault.words}{until}"
        return Event(time, tick, "/plant", EventKind.FAULT, self.fault.deputy, detail=detail)


class SatelliteFaults:
    """Faults of one deputy, in the order in which they are planned."""

    def __init__(self) -> None:
        """Without any."""
        self._sensors: list[tuple[SensorFault, Injection]] = []
        self._thrusters: list[tuple[ThrusterFault, Injection]] = []
        self._avionics: list[Injection] = []
        self._reported: Vector | None = None

    def assign(self, injections: Sequence[Injection]) -> None:
        """Have these from now on."""
        self._sensors = [(each.fault, each) for each in injections if isinstance(each.fault, SensorFault)]
        self._thrusters = [(each.fault, each) for each in injections if isinstance(each.fault, ThrusterFault)]
        self._avionics = [each for each in injections if isinstance(each.fault, AvionicsFault)]

    def read(self, sensor: str, sample: Sample, time: int) -> None:
        """Change a reading of a sensor that is taken at a time (ns)."""
        for fault, each in self._sensors:
            if fault.concerns(sensor):
                each.act(sample, time, each.memory)

    def fire(
        self, thruster: Thruster, command: Sequence[float], eclipse: bool, state: ThrusterState, time: int
    ) -> tuple[Sequence[float], ThrusterState, tuple[Denial, ...]]:
        """As `Thruster.apply`, for the tick that begins at a time (ns)."""
        forces, state, reasons = thruster.fire(command, eclipse, state)
        true, told = Firing(list(forces), thruster.tick), Firing(list(forces), thruster.tick)
        for fault, each in self._thrusters:
            each.act(true, time, each.memory)
            if fault.told:
                each.act(told, time, each.told)
        if forces is NO_FORCE and not any((*true.axes, *told.axes)) and true.leak is None:
            self._reported = None
            return forces, state, reasons
        reported, _, _ = thruster.expel(told.axes, state, (), told.leak, told.rotation)
        self._reported = np.array(reported)
        force, state, reasons = thruster.expel(true.axes, state, reasons, true.leak, true.rotation)
        return force, state, tuple(dict.fromkeys(reasons))

    def tell(self, measurement: Measurement) -> None:
        """Change what a measurement has besides its readings."""
        if self._reported is not None:
            measurement.applied_force = self._reported
        for each in self._avionics:
            each.act(measurement, measurement.time, each.memory)


class FaultInjection:
    """All faults of a run."""

    def __init__(self, planned: Sequence[PlannedFault], seed: int) -> None:
        """Plan them.

        Args:
            planned: in the order in which those of one part of a deputy act.
            seed: of the run.
        """
        self.deputies: dict[str, SatelliteFaults] = {}
        """By name, of those that have or had a fault planned."""
        self.due: float = inf
        """Next tick at which one begins or ends."""
        self._seed = seed
        self._injections: list[Injection] = []
        self.replace(planned, 0, 0)

    def replace(self, planned: Sequence[PlannedFault], tick: int, time: int) -> list[Event]:
        """Plan others from a tick at a time (ns) on; returns the events of that.

        What is planned as before goes on. A fault that is new holds from now on where it should have begun.
        """
        kept = dict(_numbered(self._injections))
        streams = Counter[str]()
        self._injections = []
        for key, each in _numbered(planned):
            stream = each.fault.stream(each.name)
            known = kept.pop(key, None)
            self._injections.append(known or Injection(each, self._seed, streams[stream]))
            streams[stream] += 1
        for name in {each.fault.deputy: None for each in self._injections}:
            self.deputies.setdefault(name, SatelliteFaults())
        for name, faults in self.deputies.items():
            faults.assign([each for each in self._injections if each.fault.deputy == name])
        self.due = tick if self._injections else inf
        return [event for each in kept.values() if (event := each.withdraw(tick, time)) is not None]

    def update(self, tick: int, time: int) -> list[Event]:
        """Begin and end those that are due at a tick at a time (ns); returns the events of that."""
        events = [event for each in self._injections if (event := each.update(tick, time)) is not None]
        changes = (change for each in self._injections for change in (each.planned.begin, each.planned.end))
        self.due = min((change for change in changes if change > tick), default=inf)
        return events


def _numbered[T: (Injection, PlannedFault)](faults: Iterable[T]) -> Iterator[tuple[tuple[str, int], T]]:
    """Each with its entry and the number of the same entries before it."""
    numbers = Counter[str]()
    for each in faults:
        entry = each.planned.entry if isinstance(each, Injection) else each.entry
        yield (entry, numbers[entry]), each
        numbers[entry] += 1
