"""The relative-motion models that laws work with, by name: those of the registry that can serve."""

from collections.abc import Callable

from formation_gnc.common import CommonParameters
from formation_gnc.errors import DesignError
from formation_gnc.orbit.elements import Elements
from formation_gnc.relative.chief import DISTINCT_PERIGEE
from formation_gnc.relative.j2_mean_motion import J2MeanMotionModel
from formation_gnc.relative.model import LinearModel
from formation_gnc.relative.nonlinear import FactorisedModel
from formation_gnc.relative.registry import MODELS
from formation_gnc.types import Vector


def _about(model: type[LinearModel]) -> Callable[[CommonParameters], LinearModel]:
    return lambda common: model.about(common.chief_elements)


DESIGN_MODELS = {
    name: _about(model) for name, model in MODELS.items() if issubclass(model, LinearModel) and model.is_periodic
}
"""Linear models, the same in every revolution, that a law can be designed on."""

CLOSED_FORM_MODELS = {
    name: _about(model) for name, model in MODELS.items() if issubclass(model, LinearModel) and model.has_closed_form
}
"""Linear models, repeating or not, whose motion over any time costs the same."""

TIME_INVARIANT_MODELS = tuple(name for name in DESIGN_MODELS if MODELS[name].is_time_invariant)
"""Those of `DESIGN_MODELS` that do not vary along the orbit."""


def transfer_model(common: CommonParameters) -> LinearModel:
    """The linear model of a law that is not designed on one: Hill's equations if the chief is near-circular."""
    name = "hill" if common.chief.eccentricity < DISTINCT_PERIGEE else "tschauner_hempel"
    return DESIGN_MODELS[name](common)


def near_circular_rates(law: str, common: CommonParameters, limit: Vector) -> tuple[float, float, float]:
    """Rates (rad/s) of the frame, the in-plane and the cross-track oscillation for a law that acts along the track.

    Raises:
        DesignError: an eccentric chief, or no thrust along the track.
    """
    if common.chief.eccentricity >= DISTINCT_PERIGEE:
        raise DesignError(
            f"{law}: chief.eccentricity is {common.chief.eccentricity:g}; it must be below {DISTINCT_PERIGEE:g}, "
            "near-circular"
        )
    check_along_track(law, limit)
    return J2MeanMotionModel.about(common.chief_elements).frequencies


def check_along_track(law: str, limit: Vector) -> None:
    """Raise DesignError for a thrust limit (3,), N, that leaves the motion in the orbit plane uncontrolled."""
    if not limit[1] > 0.0:
        raise DesignError(
            f"{law}: thrust_limit along the track is {limit[1]:g} N; it must be above 0 for control in the orbit plane"
        )


PLAN_MODELS: dict[str, Callable[[Elements], FactorisedModel]] = {
    name: model.about for name, model in MODELS.items() if issubclass(model, FactorisedModel)
}
"""Nonlinear models that a plan can be made on; their time zero is that of the chief's elements."""
