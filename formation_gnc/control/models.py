"""The relative-motion models that laws work with, by name: those of the registry that can serve."""

from collections.abc import Callable

from formation_gnc.common import CommonParameters
from formation_gnc.orbit.elements import Elements
from formation_gnc.relative.chief import DISTINCT_PERIGEE
from formation_gnc.relative.model import LinearModel
from formation_gnc.relative.nonlinear import FactorisedModel
from formation_gnc.relative.registry import MODELS


def _about(model: type[LinearModel]) -> Callable[[CommonParameters], LinearModel]:
    return lambda common: model.about(common.chief_elements)


DESIGN_MODELS = {
    name: _about(model) for name, model in MODELS.items() if issubclass(model, LinearModel) and model.is_periodic
}
"""Linear models, the same in every revolution, that a law can be designed on."""

TIME_INVARIANT_MODELS = tuple(name for name in DESIGN_MODELS if MODELS[name].is_time_invariant)
"""Those of `DESIGN_MODELS` that do not vary along the orbit."""


def transfer_model(common: CommonParameters) -> LinearModel:
    """The linear model of a law that is not designed on one: Hill's equations if the chief is near-circular."""
    name = "hill" if common.chief.eccentricity < DISTINCT_PERIGEE else "tschauner_hempel"
    return DESIGN_MODELS[name](common)


PLAN_MODELS: dict[str, Callable[[Elements], FactorisedModel]] = {
    name: model.about for name, model in MODELS.items() if issubclass(model, FactorisedModel)
}
"""Nonlinear models that a plan can be made on; their time zero is that of the chief's elements."""
