"""The truth of a run: chief and deputies, what drives them and what they measure."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from formation_gnc.errors import ConfigurationError
from formation_gnc.interface import NANOSECONDS, Measurement, SatelliteTruth, Truth, Vector
from formation_gnc.mission import LAST_SECOND, Mission
from formation_gnc.orbit.constants import EARTH_RADIUS
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import hill_rotation, inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.parameters import parameter, per_name
from formation_gnc.plant.sensors import Sensors, SensorSuite

LONGEST_STEP = 10.0
"""Integration step (s) above which a tick is divided: of order eight, it keeps an orbit in LEO below 1 mm."""

NO_ANSWER = np.full(3, np.nan)


@dataclass(frozen=True)
class DeputyParameters:
    """One deputy: where it starts, what it weighs, how it pushes and what it sees."""

    relative_state: tuple[float, ...] = parameter(
        unit="m, m/s",
        length=6,
        minimum=-1e9,
        maximum=1e9,
        doc="true state at the start relative to the chief, Hill frame",
    )
    mass: float = parameter(100.0, unit="kg", above=0.0, doc="mass")
    thrust_limit: tuple[float, ...] = parameter(
        (0.01, 0.01, 0.01), unit="N", length=3, minimum=0.0, doc="largest force per Hill axis"
    )
    sensors: SensorSuite = SensorSuite()


@dataclass(frozen=True, kw_only=True)
class PlantParameters(Mission):
    """The run and its satellites."""

    seed: int = parameter(1, minimum=0, doc="seed of every random number of the run")
    duration: float = parameter(
        unit="s", above=0.0, maximum=LAST_SECOND, doc="simulated time to fly, whole ticks"
    )
    real_time_factor: float = parameter(
        0.0, minimum=0.0, doc="simulated seconds per wall second at most; 0 for as fast as possible"
    )
    deadline: float = parameter(
        2.0,
        unit="s",
        above=0.0,
        doc="wall time a deputy has for its answer before it gets no thrust for the tick",
    )
    wait_for_recorder: bool = parameter(False, doc="do not start before a recorder listens to everything")
    deputies: tuple[str, ...] = parameter(("deputy1",), doc="names of the deputies, each a namespace")
    deputy: dict[str, DeputyParameters] = per_name("deputies")

    def __post_init__(self) -> None:
        """Raise ConfigurationError for names that cannot be namespaces and a duration of part ticks."""
        super().__post_init__()
        if len(set(self.deputies)) != len(self.deputies) or not self.deputies:
            raise ConfigurationError(
                f"parameter deputies: {list(self.deputies)} is not allowed; "
                "it must be one or more different names"
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

    @property
    def ticks(self) -> int:
        """Ticks to fly: those that begin within the duration."""
        return -(-round(self.duration * NANOSECONDS) // self.tick_ns)


class Plant:
    """Two-body plus J2 truth in the inertial frame, with thrust held over each tick.

    Use: at every tick `observe`, then `step` with the deputies' forces. Thrust acts along the Hill axes at
    the tick's start, fixed in inertial space over the tick.
    """

    def __init__(self, parameters: PlantParameters) -> None:
        """Place chief and deputies; raises ConfigurationError for one below the Earth's surface."""
        self.parameters = parameters
        self.tick = 0
        chief = state_from_elements(Elements(**vars(parameters.chief)))
        self._names = parameters.deputies
        deputies = [parameters.deputy[name] for name in self._names]
        self._states = np.array(
            [chief, *(inertial_from_relative(chief, np.array(deputy.relative_state)) for deputy in deputies)]
        )
        for name, radius in zip(self._names, np.linalg.norm(self._states[1:, :3], axis=1), strict=True):
            if radius < EARTH_RADIUS:
                raise ConfigurationError(
                    f"{name}: it starts at radius {radius:.6g} m, and must be above {EARTH_RADIUS:g} m"
                )
        self._masses = [deputy.mass for deputy in deputies]
        self._limits = [np.array(deputy.thrust_limit) for deputy in deputies]
        self._forces = [np.zeros(3) for _ in deputies]
        self._missed = [True for _ in deputies]
        self._sensors = [
            Sensors(deputy.sensors, parameters.tick_ns, parameters.seed, name)
            for name, deputy in zip(self._names, deputies, strict=True)
        ]
        self._propagator = Propagator(parameters.tick, substeps=max(1, round(parameters.tick / LONGEST_STEP)))

    @property
    def time(self) -> int:
        """Simulated time of the current tick, ns."""
        return self.tick * self.parameters.tick_ns

    @property
    def finished(self) -> bool:
        """Whether all ticks have been flown."""
        return self.tick >= self.parameters.ticks

    def observe(self) -> tuple[Truth, dict[str, Measurement]]:
        """The truth at the current tick, and what each deputy measures of it; once per tick."""
        chief = self._states[0]
        truth = Truth(self.time, chief, [])
        measurements = {}
        for index, name in enumerate(self._names):
            state, force, mass = self._states[index + 1], self._forces[index], self._masses[index]
            relative = relative_from_inertial(chief, state)
            truth.deputies.append(SatelliteTruth(name, state, relative, force, mass, False))
            sensors, readings, ages = self._sensors[index].readings(self.tick, state, chief)
            missed = self._missed[index]
            measurements[name] = Measurement(
                time=self.time,
                chief_state=chief,
                sensor=sensors,
                reading=readings,
                age=ages,
                applied_force=force,
                mass=mass,
                eclipse=False,
                fix_available=missed,
                fix=self._sensors[index].fix(relative) if missed else np.zeros(6),
                deputy=name,
            )
        return truth, measurements

    def step(self, forces: Mapping[str, Vector]) -> list[str]:
        """Fly one tick under the deputies' forces (3,), Hill frame, N.

        A deputy without an entry, or with a force that is not finite, missed the tick: it gets no thrust, and
        a fix with its next measurement, since it may have lost its state.

        Returns:
            Names of the deputies that missed the tick.
        """
        rotation = hill_rotation(self._states[0])
        accelerations = np.zeros((len(self._names) + 1, 3))
        for index, name in enumerate(self._names):
            force = forces.get(name, NO_ANSWER)
            self._missed[index] = not np.isfinite(force).all()
            limit = self._limits[index]
            self._forces[index] = np.zeros(3) if self._missed[index] else np.clip(force, -limit, limit)
            accelerations[index + 1] = self._forces[index] @ rotation / self._masses[index]
        self._states = self._propagator.advance(self.time / NANOSECONDS, self._states, accelerations)
        self.tick += 1
        return [name for name, missed in zip(self._names, self._missed, strict=True) if missed]
