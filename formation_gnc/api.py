"""The public interface of the package, for notebooks, scripts and plug-ins: all that is needed is imported from here.

These names stay; what becomes of one that has to go is in CONTRIBUTING, "Public interface". Other modules are
the project's own, and change with it. A name is loaded when it is first asked for: a plug-in is imported by the
registries that other names need, and plots take long to load.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from formation_gnc.analysis.design_report import Design as Design
    from formation_gnc.analysis.design_report import design as design
    from formation_gnc.analysis.figures import DeputyFigures as DeputyFigures
    from formation_gnc.analysis.figures import RunFigures as RunFigures
    from formation_gnc.analysis.figures import figures as figures
    from formation_gnc.analysis.overview import draw_overview as draw_overview
    from formation_gnc.analysis.overview import draw_panels as draw_panels
    from formation_gnc.analysis.panels.panel import DeputyPanel as DeputyPanel
    from formation_gnc.analysis.panels.panel import FleetPanel as FleetPanel
    from formation_gnc.analysis.plot import Axis as Axis
    from formation_gnc.analysis.plot import Curve as Curve
    from formation_gnc.analysis.plot import Plot as Plot
    from formation_gnc.analysis.report import write_report as write_report
    from formation_gnc.analysis.run_history import RunHistory as RunHistory
    from formation_gnc.analysis.trajectory import Trajectory as Trajectory
    from formation_gnc.analysis.trajectory import trajectories as trajectories
    from formation_gnc.common import CommonParameters as CommonParameters
    from formation_gnc.control.controller import Command as Command
    from formation_gnc.control.controller import Controller as Controller
    from formation_gnc.control.controller import Vehicle as Vehicle
    from formation_gnc.errors import BagError as BagError
    from formation_gnc.errors import ConfigurationError as ConfigurationError
    from formation_gnc.errors import DesignError as DesignError
    from formation_gnc.guidance.formation import Formation as Formation
    from formation_gnc.orbit.forces.force import Force as Force
    from formation_gnc.parameters import parameter as parameter
    from formation_gnc.recording import Bag as Bag
    from formation_gnc.recording import Difference as Difference
    from formation_gnc.recording import identical as identical
    from formation_gnc.recording import read as read
    from formation_gnc.records import NavigationState as NavigationState
    from formation_gnc.records import Target as Target
    from formation_gnc.relative.model import RelativeModel as RelativeModel
    from formation_gnc.sensors.sensor import Sensor as Sensor
    from formation_gnc.sil.recorded_flight import fly as fly
    from formation_gnc.sil.replay_recorder import replay_into as replay_into
    from formation_gnc.sil.runner import Run as Run
    from formation_gnc.sil.scenario import Scenario as Scenario
    from formation_gnc.sil.scenario import load_scenario as load_scenario
    from formation_gnc.supervision.monitor import Monitor as Monitor
    from formation_gnc.supervision.monitor import Observation as Observation

_PLACES = {
    "analysis.design_report": "Design design",
    "analysis.figures": "DeputyFigures RunFigures figures",
    "analysis.overview": "draw_overview draw_panels",
    "analysis.panels.panel": "DeputyPanel FleetPanel",
    "analysis.plot": "Axis Curve Plot",
    "analysis.report": "write_report",
    "analysis.run_history": "RunHistory",
    "analysis.trajectory": "Trajectory trajectories",
    "common": "CommonParameters",
    "control.controller": "Command Controller Vehicle",
    "errors": "BagError ConfigurationError DesignError",
    "guidance.formation": "Formation",
    "orbit.forces.force": "Force",
    "parameters": "parameter",
    "recording": "Bag Difference identical read",
    "records": "NavigationState Target",
    "relative.model": "RelativeModel",
    "sensors.sensor": "Sensor",
    "sil.recorded_flight": "fly",
    "sil.replay_recorder": "replay_into",
    "sil.runner": "Run",
    "sil.scenario": "Scenario load_scenario",
    "supervision.monitor": "Monitor Observation",
}
"""Names by module below formation_gnc: the imports above, for the interpreter."""

_MODULES = {name: f"formation_gnc.{module}" for module, names in _PLACES.items() for name in names.split()}

__all__ = sorted(_MODULES)


def __getattr__(name: str) -> Any:
    """Load a name of the interface."""
    if name not in _MODULES:
        raise AttributeError(f"formation_gnc.api has no {name}")
    return getattr(import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    """Names of the interface."""
    return __all__
