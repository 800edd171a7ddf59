"""Registry of formations: a new formation is one file and one entry here."""

from typing import Any

from formation_gnc.guidance.equidistant import Equidistant
from formation_gnc.guidance.formation import Formation
from formation_gnc.guidance.general_circular_orbit import GeneralCircularOrbit
from formation_gnc.guidance.helix import Helix
from formation_gnc.guidance.leader_follower import LeaderFollower
from formation_gnc.guidance.moving_plane import MovingPlane
from formation_gnc.guidance.projected_circular_orbit import ProjectedCircularOrbit
from formation_gnc.guidance.relative_elements import RelativeElements
from formation_gnc.guidance.relative_orbit import RelativeOrbit
from formation_gnc.guidance.slot_list import SlotList
from formation_gnc.guidance.tetrahedral import Tetrahedral
from formation_gnc.guidance.three_in_plane_one_out import ThreeInPlaneOneOut
from formation_gnc.plugins import load_plugins

FORMATIONS: dict[str, type[Formation[Any]]] = {
    "leader_follower": LeaderFollower,
    "relative_orbit": RelativeOrbit,
    "relative_elements": RelativeElements,
    "projected_circular_orbit": ProjectedCircularOrbit,
    "general_circular_orbit": GeneralCircularOrbit,
    "three_in_plane_one_out": ThreeInPlaneOneOut,
    "equidistant": Equidistant,
    "tetrahedral": Tetrahedral,
    "helix": Helix,
    "moving_plane": MovingPlane,
    "slot_list": SlotList,
}
FORMATIONS.update(load_plugins("formations", Formation, FORMATIONS))
