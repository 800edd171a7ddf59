"""Truth of a run: chief and deputies, their thrusters and their sensors."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from formation_gnc.errors import ConfigurationError, OrbitError, ParameterError
from formation_gnc.orbit.elements import elements_from_state, state_from_elements
from formation_gnc.orbit.environment import Environment
from formation_gnc.orbit.frames import (
    inertial_from_relative,
    relative_from_inertial,
    relative_to_first,
)
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.parameters import change, change_in_words
from formation_gnc.plant.faults.injection import FaultInjection, SatelliteFaults
from formation_gnc.plant.parameters import DeputyParameters, PlantParameters
from formation_gnc.plant.sensors import Sensors
from formation_gnc.plant.thrusters import NO_FORCE, Denial, Thruster, ThrusterState
from formation_gnc.randomness import generator
from formation_gnc.records import Event, EventKind, Measurement, SatelliteTruth, Truth
from formation_gnc.types import NANOSECONDS, Vector

NO_FIX = np.zeros(6)
NO_FIX.setflags(write=False)


@dataclass
class _Satellite:
    """State of a deputy in flight, besides its inertial state."""

    name: str
    sensors: Sensors
    thruster: Thruster
    state: ThrusterState
    eclipse: bool = False
    missed: bool = True
    denied: tuple[Denial, ...] = ()
    faults: SatelliteFaults | None = None


class Plant:
    """Truth of chief and deputies in the inertial frame, under the forces in `parameters`.

    At every tick: `measure`, then `step` with the forces that the deputies command. Thrust acts along the Hill
    axes at the start of the tick, fixed in inertial space over the tick.
    """

    def __init__(self, parameters: PlantParameters, environment: Environment | None = None) -> None:
        """Place chief and deputies.

        Args:
            parameters: the run, its forces and its satellites.
            environment: Earth, Sun, Moon and air; those that `parameters.forces` choose by default.

        Raises:
            ConfigurationError: an orbit that cannot be flown, or parameters that a thruster or sensor cannot have.
        """
        self.parameters = parameters
        self.tick, self.time = 0, 0
        """Number and simulated time (ns) of the current tick."""
        self.finished = False
        """Whether all ticks are done."""
        self._events: list[Event] = []
        chief = state_from_elements(parameters.chief_elements)
        self._states = np.array(
            [chief, *(_start(chief, name, parameters.deputy[name]) for name in parameters.deputies)]
        )
        self._forces = np.zeros((len(self._states), 3))
        """Thrust applied over the previous tick, (N, 3), Hill frame at its start, N."""
        self._satellites = [self._satellite(name, parameters.deputy[name]) for name in parameters.deputies]
        self._masses = np.array([parameters.chief_body.mass, *(each.state.mass for each in self._satellites)])
        """(N,) at the start of the tick, kg."""
        self._faults = FaultInjection(parameters.planned_faults, parameters.seed)
        self._committed: PlantParameters | None = None
        self._propagator = Propagator(
            parameters.tick,
            math.ceil(parameters.tick / parameters.step),
            parameters.forces,
            [parameters.chief_body, *(parameters.deputy[name] for name in parameters.deputies)],
            parameters.epoch,
            environment,
        )

    def _satellite(self, name: str, deputy: DeputyParameters) -> _Satellite:
        parameters = self.parameters
        sensors = Sensors(deputy.sensors, parameters.tick_ns, parameters.seed, name)
        random = generator(parameters.seed, f"{name}/thrusters")
        try:
            thruster = Thruster(deputy.thrusters, parameters.tick, random)
            return _Satellite(name, sensors, thruster, thruster.start(deputy.mass))
        except ConfigurationError as error:
            raise ConfigurationError(f"{name}: {error}") from None

    def measure(self) -> dict[str, Measurement]:
        """Measurement of each deputy at the current tick, by name; once per tick, before `step`."""
        if self.tick >= self._faults.due:
            self._update_faults()
        chief, seconds = self._states[0], self.time / NANOSECONDS
        measurements = {}
        for index, satellite in enumerate(self._satellites, 1):  # indexed: iterating over an array is slow
            state = self._states[index]
            satellite.eclipse = self._propagator.illumination(seconds, state) < 1.0
            missed = satellite.missed
            # Positional: keyword arguments take twice as long.
            measurement = Measurement(
                self.time,
                satellite.name,
                chief,
                satellite.sensors.readings(self.tick, state, chief),
                self._forces[index],
                satellite.state.mass,
                satellite.eclipse,
                missed,
                satellite.sensors.fix(relative_from_inertial(chief, state)) if missed else NO_FIX,
            )
            measurements[satellite.name] = measurement
            if satellite.faults is not None:
                satellite.faults.tell(measurement)
        return measurements

    def truth(self) -> Truth:
        """Truth at the current tick; after `measure`."""
        relative = relative_to_first(self._states)
        deputies = [
            SatelliteTruth(
                satellite.name,
                self._states[index],
                relative[index - 1],
                self._forces[index],
                satellite.state.mass,
                satellite.eclipse,
            )
            for index, satellite in enumerate(self._satellites, 1)
        ]
        return Truth(self.time, self._states[0], deputies)

    def step(self, forces: Mapping[str, Vector]) -> list[str]:
        """Propagate over one tick; after `measure`.

        A deputy without an entry, or with a force that is not finite, missed the tick: it gets no thrust, and
        a fix with its next measurement, since it may have lost its state.

        Args:
            forces: commanded by each deputy, (3,), Hill frame, N.

        Returns:
            Names of the deputies that missed the tick.

        Raises:
            ImpactError: a satellite has come down.
        """
        applied, masses = np.zeros((len(self._states), 3)), self._masses
        missed = []
        for index, satellite in enumerate(self._satellites, 1):
            command, before = forces.get(satellite.name), satellite.state
            commanded = NO_FORCE if command is None else command.tolist()
            force, after, denied = (
                satellite.thruster.apply(commanded, satellite.eclipse, before)
                if satellite.faults is None
                else satellite.faults.fire(satellite.thruster, commanded, satellite.eclipse, before, self.time)
            )
            applied[index] = force
            satellite.state = after
            if after.mass != before.mass:
                if self._masses is masses:
                    self._masses = masses.copy()
                self._masses[index] = after.mass
            satellite.missed = command is None or Denial.NOT_FINITE in denied
            if satellite.missed:
                missed.append(satellite.name)
            if denied != satellite.denied:
                self._note(satellite, denied)
        self._forces = applied
        self._states = self._propagator.propagate_with_thrust(self.time / NANOSECONDS, self._states, applied, masses)
        self.tick += 1
        self.time += self.parameters.tick_ns
        self.finished = self.tick == self.parameters.ticks
        return missed

    def stage(self, changes: Mapping[str, Any]) -> PlantParameters:
        """Parameters with a change in flight, without effect yet.

        Raises:
            ParameterError: the change is not allowed, or adds a fault that should have ended.
        """
        before = self._committed or self.parameters
        changed = change(before, changes)
        for each in changed.planned_faults:
            if each.end <= self.tick and each.entry not in before.faults:
                raise ParameterError(
                    f"parameter faults: {each.entry!r} is not allowed; until must be above "
                    f"{self.time / NANOSECONDS:g} s, which is now"
                )
        return changed

    def commit(self, staged: PlantParameters) -> None:
        """Let staged parameters take effect when the next tick begins."""
        self._committed, self._faults.due = staged, self.tick

    def _update_faults(self) -> None:
        """Take faults changed in flight, and begin and end those that are due."""
        if self._committed is not None:
            before, self.parameters, self._committed = self.parameters, self._committed, None
            changes, detail = change_in_words(before, self.parameters)
            if changes:
                self._events.append(Event(self.time, self.tick, "/plant", EventKind.PARAMETERS, "", changes, detail))
            self._events += self._faults.replace(self.parameters.planned_faults, self.tick, self.time)
        self._events += self._faults.update(self.tick, self.time)
        for satellite in self._satellites:
            if satellite.faults is None and satellite.name in self._faults.deputies:
                satellite.faults = self._faults.deputies[satellite.name]
                satellite.sensors.inject(satellite.faults)

    def _note(self, satellite: _Satellite, denied: tuple[Denial, ...]) -> None:
        """Record an event when the reasons change for which a deputy's thrusters deny its command."""
        denied = tuple(reason for reason in denied if reason is not Denial.NOT_FINITE)
        if denied != satellite.denied:
            satellite.denied = denied
            detail = ", ".join(denied) or "as commanded again"
            self._events.append(
                Event(self.time, self.tick, "/plant", EventKind.THRUSTERS, satellite.name, detail=detail)
            )

    def take_events(self) -> list[Event]:
        """Events since the last call."""
        events, self._events = self._events, []
        return events


def _start(chief: Vector, name: str, deputy: DeputyParameters) -> Vector:
    """Inertial state (6,) of a deputy at the start.

    Raises:
        ParameterError: a start on the chief, or on an orbit that cannot be flown.
    """
    relative = np.array(deputy.relative_state)
    if not relative[:3].any():
        raise ParameterError(
            f"parameter {name}.relative_state: {relative.tolist()} is not allowed; its position must be off the chief's"
        )
    state = inertial_from_relative(chief, relative)
    try:
        elements_from_state(state)
    except OrbitError as error:
        raise ParameterError(
            f"parameter {name}.relative_state: {relative.tolist()} is not allowed; its orbit has {error}"
        ) from None
    return state
