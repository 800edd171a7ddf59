"""The relative-motion models that a law can be designed on, by name."""

from collections.abc import Callable

from formation_gnc.mission import Mission
from formation_gnc.orbit.elements import Elements
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.j2_gradient import J2GradientModel
from formation_gnc.relative.model import RelativeModel
from formation_gnc.relative.schweighart_sedwick import CircularReference, SchweighartSedwickModel
from formation_gnc.relative.tschauner_hempel import TschaunerHempelModel

DESIGN_MODELS: dict[str, Callable[[Mission], RelativeModel]] = {
    "hill": lambda mission: HillModel(mission.mean_motion),
    "schweighart_sedwick": lambda mission: SchweighartSedwickModel(CircularReference.of(_elements(mission))),
    "j2_gradient": lambda mission: J2GradientModel(CircularReference.of(_elements(mission))),
    "tschauner_hempel": lambda mission: TschaunerHempelModel(KeplerChief.of(_elements(mission))),
}


def _elements(mission: Mission) -> Elements:
    return Elements(**vars(mission.chief))
