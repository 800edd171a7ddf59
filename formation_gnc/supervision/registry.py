"""All health monitors by name: a new one is one file in `monitors/` and one line here, or a plug-in."""

from formation_gnc.common import ANY_ORBIT
from formation_gnc.plugins import load_plugins
from formation_gnc.sensors.registry import sensors
from formation_gnc.supervision.fault_table import Entry, parse, table_of
from formation_gnc.supervision.monitor import Monitor
from formation_gnc.supervision.monitors.chief_ephemeris import ChiefEphemeris
from formation_gnc.supervision.monitors.control_error import ControlError
from formation_gnc.supervision.monitors.covariance import Covariance
from formation_gnc.supervision.monitors.dropout import Dropout
from formation_gnc.supervision.monitors.estimate_jump import EstimateJump
from formation_gnc.supervision.monitors.frozen_estimate import FrozenEstimate
from formation_gnc.supervision.monitors.frozen_readings import FrozenReadings
from formation_gnc.supervision.monitors.heartbeat import CycleSlips, Heartbeat
from formation_gnc.supervision.monitors.innovation_consistency import InnovationConsistency
from formation_gnc.supervision.monitors.innovation_shift import InnovationBias, InnovationDrift
from formation_gnc.supervision.monitors.mass import Mass
from formation_gnc.supervision.monitors.neighbours import Neighbours
from formation_gnc.supervision.monitors.propellant import Propellant
from formation_gnc.supervision.monitors.residual_acceleration import ResidualAcceleration
from formation_gnc.supervision.monitors.saturation import Saturation
from formation_gnc.supervision.monitors.separation import Separation
from formation_gnc.supervision.monitors.solver_fallback import SolverFallback
from formation_gnc.supervision.monitors.thrust_response import ThrustResponse
from formation_gnc.supervision.monitors.thruster_on import ThrusterOn
from formation_gnc.supervision.parameters import SupervisorParameters
from formation_gnc.types import AXES

MONITORS: dict[str, type[Monitor]] = {
    "innovation_bias": InnovationBias,
    "innovation_drift": InnovationDrift,
    "innovation_consistency": InnovationConsistency,
    "frozen_readings": FrozenReadings,
    "dropout": Dropout,
    "covariance": Covariance,
    "estimate_jump": EstimateJump,
    "frozen_estimate": FrozenEstimate,
    "residual_acceleration": ResidualAcceleration,
    "chief_ephemeris": ChiefEphemeris,
    "thrust_response": ThrustResponse,
    "thruster_on": ThrusterOn,
    "mass": Mass,
    "control_error": ControlError,
    "saturation": Saturation,
    "solver_fallback": SolverFallback,
    "propellant": Propellant,
    "separation": Separation,
    "neighbours": Neighbours,
    "heartbeat": Heartbeat,
    "cycle_slips": CycleSlips,
}
MONITORS.update(load_plugins("monitors", Monitor, MONITORS))


def table() -> str:
    """Markdown table of the monitors: what each watches, about what, and how it decides."""
    lines = ["| monitor | watches | decides by |", "|---|---|---|"]
    lines += [f"| `{name}` | {monitor.title} | {monitor.test} |" for name, monitor in MONITORS.items()]
    return "\n".join(lines)


def read_fault_table(parameters: SupervisorParameters) -> tuple[Entry, ...]:
    """The fault table of some parameters; raises ParameterError for one that is not allowed."""
    subjects = {name: monitor.subjects(parameters) for name, monitor in MONITORS.items()}
    return parse(parameters.fault_table, subjects, tuple(sensors()), AXES)


def default_fault_table() -> str:
    """Markdown table of the default fault table."""
    return table_of(read_fault_table(SupervisorParameters(ANY_ORBIT)))
