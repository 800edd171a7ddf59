"""Parameters of guidance."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from formation_gnc.common import LAST_SECOND
from formation_gnc.flight.module import ModuleParameters
from formation_gnc.guidance.registry import FORMATIONS
from formation_gnc.guidance.targets import TARGET_MODELS
from formation_gnc.parameters import parameter, per_entry


@dataclass(frozen=True)
class GuidanceParameters(ModuleParameters):
    """Parameters of the guidance node: those common to all formations, and each formation's own under its name."""

    formation: str = parameter("leader_follower", choices=FORMATIONS, in_flight=True, doc="formation in force")
    slot: int = parameter(0, minimum=0, maximum=1000, in_flight=True, doc="the deputy's slot in the formation, from 0")
    phase: float = parameter(
        0.0, unit="rad", in_flight=True, doc="phase of the whole formation at the start of the run"
    )
    model: str = parameter("hill", choices=TARGET_MODELS, in_flight=True, doc="relative-motion model of the target")
    reconfiguration_time: float = parameter(
        0.0,
        unit="s",
        minimum=0.0,
        maximum=LAST_SECOND,
        in_flight=True,
        doc="time allowed for reaching a changed target, during which no other change of target is accepted; "
        "an event warns when the thrusters need longer; 0 for no limit",
    )
    fleet: tuple[str, ...] = parameter(
        (),
        doc="names of all satellites of the formation, the deputy's included, whose estimates guidance waits for; "
        "empty for a deputy on its own",
    )
    assignment: str = parameter(
        "fixed",
        choices=("fixed", "delta_v", "fuel"),
        doc="how slots are assigned: fixed by slot and phase; delta_v for the least total delta-v of the fleet, "
        "with the phase free, at the start and at every change of target; fuel likewise, with each delta-v "
        "weighted by the inverse of the propellant left",
    )
    dry_masses: tuple[float, ...] = parameter(
        (),
        follows="{fleet}.thrusters.dry_mass",
        unit="kg",
        minimum=0.0,
        doc="dry mass of each satellite of the fleet, for assignment by fuel",
    )
    separation_warning: float = parameter(
        0.0,
        unit="m",
        minimum=0.0,
        in_flight=True,
        doc="predicted distance to another satellite of the fleet below which an event warns; 0 for none",
    )
    safe_distance: float = parameter(
        0.0,
        unit="m",
        minimum=0.0,
        in_flight=True,
        doc="distance from the chief's track, across the flight direction, below which an event warns that a new "
        "target is not passively safe; 0 for none",
    )
    separation_interval: float = parameter(
        60.0, unit="s", above=0.0, in_flight=True, doc="time between predictions of the separations in the fleet"
    )
    separation_horizon: float = parameter(
        2.0,
        above=0.0,
        maximum=100.0,
        in_flight=True,
        doc="horizon, in revolutions, of the predicted separations without thrust",
    )
    thrust_limit: tuple[float, ...] = parameter(
        (0.01, 0.01, 0.01),
        follows="{deputy}.thrusters.limit",
        unit="N",
        length=3,
        minimum=0.0,
        doc="largest force per Hill axis, for the shortest time to a changed target",
    )
    preview_steps: int = parameter(0, minimum=0, maximum=10_000, doc="number of target states in the preview")
    preview_step: float = parameter(
        60.0, unit="s", minimum=1e-9, maximum=LAST_SECOND, doc="time between target states in the preview"
    )
    formations: Mapping[str, Any] = per_entry(FORMATIONS)

    @property
    def formation_parameters(self) -> Any:
        """The own parameters of the formation in force."""
        return self.formations[self.formation]
