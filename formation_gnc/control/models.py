"""The relative-motion models that a law can be designed on, by name."""

from collections.abc import Callable

from formation_gnc.common import CommonParameters
from formation_gnc.orbit.elements import Elements
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.j2_gradient import J2GradientModel
from formation_gnc.relative.model import RelativeModel
from formation_gnc.relative.schweighart_sedwick import CircularReference, SchweighartSedwickModel
from formation_gnc.relative.tschauner_hempel import TschaunerHempelModel

DESIGN_MODELS: dict[str, Callable[[CommonParameters], RelativeModel]] = {
    "hill": lambda common: HillModel(common.mean_motion),
    "schweighart_sedwick": lambda common: SchweighartSedwickModel(CircularReference.of(_elements(common))),
    "j2_gradient": lambda common: J2GradientModel(CircularReference.of(_elements(common))),
    "tschauner_hempel": lambda common: TschaunerHempelModel(KeplerChief.of(_elements(common))),
}


def _elements(common: CommonParameters) -> Elements:
    return Elements(**vars(common.chief))
