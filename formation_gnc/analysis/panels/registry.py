"""All panels, in the order in which they are drawn; a new one is a file and a line here."""

from formation_gnc.analysis.panels.control_error import CONTROL_ERROR, CONTROL_ERROR_BY_AXIS
from formation_gnc.analysis.panels.distances import DISTANCES
from formation_gnc.analysis.panels.estimation_error import POSITION_ERROR, VELOCITY_ERROR
from formation_gnc.analysis.panels.innovations import INNOVATIONS
from formation_gnc.analysis.panels.modes import MODES
from formation_gnc.analysis.panels.panel import DeputyPanel, FleetPanel
from formation_gnc.analysis.panels.path import PATH
from formation_gnc.analysis.panels.readings import READINGS
from formation_gnc.analysis.panels.solver import SOLVER
from formation_gnc.analysis.panels.thrust import THRUST
from formation_gnc.analysis.panels.timing import TIMING
from formation_gnc.analysis.panels.trajectory import TRAJECTORY

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
