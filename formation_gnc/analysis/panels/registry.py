"""All panels, in the order in which they are drawn; a new one is a file and a line here, or a plug-in."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from formation_gnc.analysis.panels.control_error import CONTROL_ERROR, CONTROL_ERROR_BY_AXIS
from formation_gnc.analysis.panels.distances import DISTANCES
from formation_gnc.analysis.panels.estimation_error import POSITION_ERROR, VELOCITY_ERROR
from formation_gnc.analysis.panels.innovations import INNOVATIONS
from formation_gnc.analysis.panels.modes import MODES
from formation_gnc.analysis.panels.panel import DeputyPanel, FleetPanel, Panel
from formation_gnc.analysis.panels.path import PATH
from formation_gnc.analysis.panels.readings import READINGS
from formation_gnc.analysis.panels.solver import SOLVER
from formation_gnc.analysis.panels.thrust import THRUST
from formation_gnc.analysis.panels.timing import TIMING
from formation_gnc.analysis.panels.trajectory import TRAJECTORY
from formation_gnc.analysis.plot import Plot
from formation_gnc.plugins import load_plugins

FLEET_PANELS: list[FleetPanel] = [
    TRAJECTORY,
    DISTANCES,
]

DEPUTY_PANELS: list[DeputyPanel] = [
    PATH,
    MODES,
    CONTROL_ERROR,
    CONTROL_ERROR_BY_AXIS,
    POSITION_ERROR,
    VELOCITY_ERROR,
    THRUST,
    SOLVER,
    TIMING,
    READINGS,
    INNOVATIONS,
]


def guarded[P: Panel[Any]](name: str, panel: P) -> P:
    """A plug-in's panel, without plots where it raises: that is said, and all others are drawn."""

    def plots(history: Any) -> Sequence[Plot]:
        try:
            return panel.plots(history)
        except Exception as error:  # whatever a plug-in's raises
            print(f"formation-gnc: figure {name} is left out: {type(error).__name__}: {error}", file=sys.stderr)
            return []

    return replace(panel, plots=plots)


_names = [*(panel.name for panel in FLEET_PANELS), *(panel.name for panel in DEPUTY_PANELS)]
for _name, _panel in load_plugins("figures", Panel, _names):
    _panels: list[Any] = FLEET_PANELS if isinstance(_panel, FleetPanel) else DEPUTY_PANELS
    _panels.append(guarded(_name, _panel))
