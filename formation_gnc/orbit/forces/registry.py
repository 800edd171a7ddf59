"""The registry of forces.

A new force is one new file beside this one and one line here: its parameters join `Forces`, the scenario files
and the reference page, and its acceleration the compiled sum.
"""

from formation_gnc.orbit.forces.drag import DRAG
from formation_gnc.orbit.forces.force import Force
from formation_gnc.orbit.forces.radiation import RADIATION_PRESSURE
from formation_gnc.orbit.forces.third_body import MOON_ATTRACTION, SUN_ATTRACTION
from formation_gnc.plugins import load_plugins

FORCES: list[Force] = [
    SUN_ATTRACTION,
    MOON_ATTRACTION,
    RADIATION_PRESSURE,
    DRAG,
    *(force for _, force in load_plugins("forces", Force, ())),
]
"""In the order in which they are summed."""
