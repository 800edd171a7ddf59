"""Parameters of supervision."""

from dataclasses import dataclass

from formation_gnc.common import LAST_SECOND
from formation_gnc.flight.module import ModuleParameters
from formation_gnc.parameters import parameter
from formation_gnc.sensors.registry import sensors
from formation_gnc.supervision.fault_table import DEFAULT
from formation_gnc.supervision.modes import Mode


@dataclass(frozen=True)
class SupervisorParameters(ModuleParameters):
    """What the satellite is, how often a false alarm may come, and what each mode demands."""

    mode: str = parameter(
        str(Mode.ACQUIRE),
        choices=tuple(Mode),
        in_flight=True,
        doc="mode of the satellite; set in flight, a command, which may be refused. It follows the mode in force",
    )
    enabled: bool = parameter(
        True,
        in_flight=True,
        doc="whether faults are looked for and answered; without, the mode changes by command and event alone",
    )
    false_alarm: float = parameter(
        1e-3,
        above=0.0,
        maximum=0.1,
        doc="probability of a false alarm of any monitor in a whole flight",
    )
    duration: float = parameter(
        86400.0,
        follows="duration",
        unit="s",
        above=0.0,
        maximum=LAST_SECOND,
        doc="length of the flight that the probability of a false alarm is for",
    )
    tube: float = parameter(
        10.0,
        unit="m",
        above=0.0,
        maximum=1e6,
        in_flight=True,
        doc="control error up to which the target counts as reached; beyond one and a half times of it, as left",
    )
    largest_sigma: float = parameter(
        5.0,
        unit="m",
        above=0.0,
        maximum=1e6,
        in_flight=True,
        doc="largest standard deviation of the position on any axis while the formation is kept or reconfigured; "
        "ten times of it while it is acquired",
    )
    least_separation: float = parameter(
        0.0,
        unit="m",
        minimum=0.0,
        maximum=1e6,
        in_flight=True,
        doc="least distance to any other satellite, predicted with its uncertainty; 0 for none",
    )
    fault_table: tuple[str, ...] = parameter(
        DEFAULT,
        in_flight=True,
        doc="answers to faults, each `{monitor: NAME, subject: PATTERN, persistence: TICKS, response: NAME, "
        "return: TICKS, modes: [MODE, ...]}` with `mode` for go_to and `laws` for switch_law",
    )
    sensors: tuple[str, ...] = parameter(
        tuple(name for name, sensor in sensors().items() if sensor.on),
        follows="{deputy}.sensors.*.on",
        in_flight=True,
        doc="sensors that are to read",
    )
    mass: float = parameter(100.0, follows="{deputy}.mass", unit="kg", above=0.0, doc="initial mass")
    dry_mass: float = parameter(
        0.0, follows="{deputy}.thrusters.dry_mass", unit="kg", minimum=0.0, doc="mass at which the tank is empty"
    )
    specific_impulse: float = parameter(
        0.0,
        follows="{deputy}.thrusters.specific_impulse",
        unit="s",
        minimum=0.0,
        doc="exhaust velocity over standard gravity; 0 for thrust that costs no mass",
    )
    thrust_limit: tuple[float, ...] = parameter(
        (0.01, 0.01, 0.01),
        follows="{deputy}.thrusters.limit",
        unit="N",
        length=3,
        minimum=0.0,
        doc="largest force per Hill axis",
    )
    total_thrust: float = parameter(
        0.0,
        follows="{deputy}.thrusters.total_limit",
        unit="N",
        minimum=0.0,
        doc="largest magnitude of one gimballed thruster; 0 for one thruster per axis",
    )
    dead_band: float = parameter(
        0.0,
        follows="{deputy}.thrusters.dead_band",
        unit="N",
        minimum=0.0,
        doc="command per axis below which nothing fires",
    )
    minimum_impulse: float = parameter(
        0.0,
        follows="{deputy}.thrusters.minimum_impulse",
        unit="N s",
        minimum=0.0,
        doc="smallest impulse per axis and tick",
    )
    quantum: float = parameter(
        0.0, follows="{deputy}.thrusters.quantum", unit="N", minimum=0.0, doc="step between forces per axis"
    )
    off_in_eclipse: bool = parameter(
        False, follows="{deputy}.thrusters.off_in_eclipse", doc="no thrust while any of the Sun is hidden"
    )

    @property
    def ticks(self) -> int:
        """Number of ticks in the flight."""
        return max(1, round(self.duration / self.tick))
