"""Parameters of the plant: the run, its forces and its satellites."""

from dataclasses import dataclass
from functools import cached_property

from formation_gnc.common import LAST_EPOCH, LAST_SECOND, CommonParameters
from formation_gnc.errors import ParameterError
from formation_gnc.orbit.forces.force import Body
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.parameters import parameter, per_name
from formation_gnc.plant.faults.plan import FORM, PlannedFault, plan_faults
from formation_gnc.plant.sensors import SensorSuite
from formation_gnc.plant.thrusters import ThrusterParameters
from formation_gnc.types import NANOSECONDS


@dataclass(frozen=True, kw_only=True)
class DeputyParameters(Body):
    """One deputy: initial state, body, thrusters and sensors."""

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
    on_recorder_loss: str = parameter(
        "continue",
        choices=("continue", "end"),
        doc="what the run does when its recorder has died, or its disk is full: go on without one, or end",
    )
    deputies: tuple[str, ...] = parameter(("deputy1",), doc="names of the deputies, each a namespace")
    deputy: dict[str, DeputyParameters] = per_name("deputies")
    faults: tuple[str, ...] = parameter(
        (),
        in_flight=True,
        doc=f"faults injected, each like `{FORM}`, in the order in which they act. What is added in flight and "
        "should have begun holds at once; what is left out ends",
    )

    def __post_init__(self) -> None:
        """Check the names of the deputies and the duration.

        Raises:
            ParameterError: a name that is no namespace or comes twice, a duration below a tick, one that ends
                beyond the years of the ephemerides, or a fault that is not allowed.
        """
        super().__post_init__()
        if len(set(self.deputies)) != len(self.deputies) or not self.deputies:
            raise ParameterError(
                f"parameter deputies: {list(self.deputies)} is not allowed; it must be one or more different names"
            )
        for name in self.deputies:
            if not (name.isidentifier() and name.isascii()):
                raise ParameterError(
                    f"parameter deputies: {name!r} is not allowed; a name has letters, digits and _ only"
                )
        if round(self.duration * NANOSECONDS) < self.tick_ns:
            raise ParameterError(f"parameter duration: {self.duration!r} s is not allowed; it must be a tick or more")
        if self.epoch + self.duration > LAST_EPOCH:
            raise ParameterError(
                f"parameter duration: {self.duration!r} s is not allowed; with epoch {self.epoch!r} s it must end by "
                f"{LAST_EPOCH!r} s since J2000.0, where the ephemerides of Sun and Moon end"
            )
        self.planned_faults  # noqa: B018 - to be checked

    @cached_property
    def planned_faults(self) -> tuple[PlannedFault, ...]:
        """The faults; raises ParameterError for one that is not allowed."""
        return plan_faults(self.faults, self.deputy, self.tick_ns)

    @cached_property
    def ticks(self) -> int:
        """Number of ticks that begin within the duration."""
        return -(-round(self.duration * NANOSECONDS) // self.tick_ns)
