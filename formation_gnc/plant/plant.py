"""The truth of a run: chief and deputies, what drives them and what they measure."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from formation_gnc.common import LAST_SECOND, CommonParameters
from formation_gnc.errors import ConfigurationError
from formation_gnc.orbit.elements import Elements, elements_from_state, state_from_elements
from formation_gnc.orbit.forces.force import Body
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.frames import (
    inertial_from_relative,
    relative_from_inertial,
    relative_to_first,
)
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.parameters import parameter, per_name
from formation_gnc.plant.sensors import Sensors, SensorSuite
from formation_gnc.plant.thrusters import NO_FORCE, Denial, Thruster, ThrusterParameters, ThrusterState
from formation_gnc.randomness import generator
from formation_gnc.records import Event, EventKind, Measurement, SatelliteTruth, Truth
from formation_gnc.types import NANOSECONDS, Vector


@dataclass(frozen=True, kw_only=True)
class DeputyParameters(Body):
    """One deputy: where it starts, what the forces act on, how it pushes and what it sees."""

    relative_state: tuple[float, ...] = parameter(
        unit="m, m/s",
        length=6,
        minimum=-1e9,
        maximum=1e9,
        doc="true state at the start relative to the chief, Hill frame",
    )
    thrusters: ThrusterParameters = ThrusterParameters()
    sensors: SensorSuite = SensorSuite()


@dataclass(frozen=True, kw_only=True)
class PlantParameters(CommonParameters):
    """The run and its satellites."""

    seed: int = parameter(1, minimum=0, doc="seed of every random number of the run")
    duration: float = parameter(unit="s", above=0.0, maximum=LAST_SECOND, doc="simulated time to fly, whole ticks")
    real_time_factor: float = parameter(
        0.0, minimum=0.0, doc="simulated seconds per wall second at most; 0 for as fast as possible"
    )
    deadline: float = parameter(
        2.0,
        unit="s",
        above=0.0,
        doc="wall time a deputy has for its answer before it gets no thrust for the tick",
    )
    step: float = parameter(
        10.0, unit="s", above=0.0, doc="longest integration step, of order eight; a longer tick is divided"
    )
    forces: Forces = Forces()
    chief_body: Body = Body()
    wait_for_recorder: bool = parameter(False, doc="do not start before a recorder listens to everything")
    deputies: tuple[str, ...] = parameter(("deputy1",), doc="names of the deputies, each a namespace")
    deputy: dict[str, DeputyParameters] = per_name("deputies")

    def __post_init__(self) -> None:
        """Raise ConfigurationError for names that cannot be namespaces and a duration of part ticks."""
        super().__post_init__()
        if len(set(self.deputies)) != len(self.deputies) or not self.deputies:
            raise ConfigurationError(
                f"parameter deputies: {list(self.deputies)} is not allowed; it must be one or more different names"
            )
        for name in self.deputies:
            if not (name.isidentifier() and name.isascii()):
                raise ConfigurationError(
                    f"parameter deputies: {name!r} is not allowed; a name has letters, digits and _ only"
                )
        if round(self.duration * NANOSECONDS) < self.tick_ns:
            raise ConfigurationError(
                f"parameter duration: {self.duration!r} s is not allowed; it must be a tick or more"
            )

    @cached_property
    def ticks(self) -> int:
        """Ticks to fly: those that begin within the duration."""
        return -(-round(self.duration * NANOSECONDS) // self.tick_ns)


NO_FIX = np.zeros(6)
NO_FIX.setflags(write=False)


@dataclass
class _Satellite:
    """A deputy in flight, besides its inertial state."""

    name: str
    sensors: Sensors
    thruster: Thruster
    state: ThrusterState
    eclipse: bool = False
    missed: bool = True
    denied: tuple[Denial, ...] = ()


class Plant:
    """Truth of chief and deputies in the inertial frame, under the forces in `parameters`.

    Use: at every tick `measure`, then `step` with the deputies' forces. Thrust acts along the Hill axes at
    the tick's start, fixed in inertial space over the tick.
    """

    def __init__(self, parameters: PlantParameters) -> None:
        """Place chief and deputies; raises ConfigurationError for one that cannot fly."""
        self.parameters = parameters
        self.tick, self.time = 0, 0
        """Number and simulated time (ns) of the current tick."""
        self.finished = False
        """Whether all ticks have been flown."""
        self._events: list[Event] = []
        chief = state_from_elements(Elements(**vars(parameters.chief)))
        self._states = np.array(
            [chief, *(_start(chief, name, parameters.deputy[name]) for name in parameters.deputies)]
        )
        self._forces = np.zeros((len(self._states), 3))
        """Given over the tick before, Hill frame at its start, N; in the order of the states."""
        self._satellites = [self._satellite(name, parameters.deputy[name]) for name in parameters.deputies]
        self._propagator = Propagator(
            parameters.tick,
            math.ceil(parameters.tick / parameters.step),
            parameters.forces,
            [parameters.chief_body, *(parameters.deputy[name] for name in parameters.deputies)],
            parameters.epoch,
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
        """What each deputy measures of the truth at the current tick; once per tick, before `step`."""
        chief, seconds = self._states[0], self.time / NANOSECONDS
        measurements = {}
        for place, satellite in enumerate(self._satellites, 1):  # an array ends its iteration with an error
            state = self._states[place]
            satellite.eclipse = self._propagator.illumination(seconds, state) < 1.0
            missed = satellite.missed
            # In the order of its fields: by their names it would take twice as long.
            measurements[satellite.name] = Measurement(
                self.time,
                satellite.name,
                chief,
                satellite.sensors.readings(self.tick, state, chief),
                self._forces[place],
                satellite.state.mass,
                satellite.eclipse,
                missed,
                satellite.sensors.fix(relative_from_inertial(chief, state)) if missed else NO_FIX,
            )
        return measurements

    def truth(self) -> Truth:
        """The truth at the current tick; after `measure`."""
        relative = relative_to_first(self._states)
        deputies = [
            SatelliteTruth(
                satellite.name,
                self._states[place],
                relative[place - 1],
                self._forces[place],
                satellite.state.mass,
                satellite.eclipse,
            )
            for place, satellite in enumerate(self._satellites, 1)
        ]
        return Truth(self.time, self._states[0], deputies)

    def step(self, forces: Mapping[str, Vector]) -> list[str]:
        """Fly one tick under the deputies' forces (3,), Hill frame, N; after `measure`.

        A deputy without an entry, or with a force that is not finite, missed the tick: it gets no thrust, and
        a fix with its next measurement, since it may have lost its state.

        Returns:
            Names of the deputies that missed the tick.

        Raises:
            ImpactError: a satellite has come down.
        """
        given: list[Sequence[float]] = [NO_FORCE]
        masses = [self.parameters.chief_body.mass]
        missed = []
        for satellite in self._satellites:
            asked = forces.get(satellite.name)
            masses.append(satellite.state.mass)
            force, satellite.state, denied = satellite.thruster.apply(
                NO_FORCE if asked is None else asked.tolist(), satellite.eclipse, satellite.state
            )
            given.append(force)
            satellite.missed = asked is None or Denial.NOT_FINITE in denied
            if satellite.missed:
                missed.append(satellite.name)
            if denied != satellite.denied:
                self._note(satellite, denied)
        self._forces = np.array(given)
        seconds = self.time / NANOSECONDS
        self._states = self._propagator.propagate_with_thrust(seconds, self._states, self._forces, np.array(masses))
        self.tick += 1
        self.time += self.parameters.tick_ns
        self.finished = self.tick == self.parameters.ticks
        return missed

    def _note(self, satellite: _Satellite, denied: tuple[Denial, ...]) -> None:
        """Note it when the reasons change for which a deputy's thrusters do not give what is asked."""
        denied = tuple(reason for reason in denied if reason is not Denial.NOT_FINITE)
        if denied != satellite.denied:
            satellite.denied = denied
            detail = ", ".join(denied) or "as commanded again"
            self._events.append(
                Event(self.time, self.tick, "/plant", EventKind.THRUSTERS, satellite.name, detail=detail)
            )

    def take_events(self) -> list[Event]:
        """The events noted since they were last taken."""
        events, self._events = self._events, []
        return events


def _start(chief: Vector, name: str, deputy: DeputyParameters) -> Vector:
    """Inertial state (6,) of a deputy at the start; raises ConfigurationError for an orbit that cannot be
    flown."""
    relative = np.array(deputy.relative_state)
    if not relative[:3].any():
        raise ConfigurationError(
            f"parameter {name}.relative_state: {relative.tolist()} is not allowed; its position must be off the chief's"
        )
    state = inertial_from_relative(chief, relative)
    try:
        elements_from_state(state)
    except ConfigurationError as error:
        raise ConfigurationError(
            f"parameter {name}.relative_state: {relative.tolist()} is not allowed; its orbit has {error}"
        ) from None
    return state
