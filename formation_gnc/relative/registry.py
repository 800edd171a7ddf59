"""The registry of relative-motion models.

A new model is one new file beside this one and one line here. Flight software chooses from it by what a model
states that it is (`formation_gnc.relative.model.RelativeModel`): design models are linear and periodic, filters
predict with time-invariant linear ones, targets move by linear ones in closed form, plans are made on factorised
ones. So a new model is offered wherever it can serve.
"""

from formation_gnc.plugins import load_plugins
from formation_gnc.relative.elements_model import RelativeElementsModel
from formation_gnc.relative.gim_alfriend import GimAlfriendModel
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.j2_gradient import J2GradientModel
from formation_gnc.relative.j2_mean_motion import J2MeanMotionModel
from formation_gnc.relative.model import RelativeModel
from formation_gnc.relative.nonlinear import NonlinearModel
from formation_gnc.relative.oblate import OblateModel
from formation_gnc.relative.schweighart_sedwick import SchweighartSedwickModel, SchweighartSedwickNodalModel
from formation_gnc.relative.tschauner_hempel import TschaunerHempelModel

MODELS: dict[str, type[RelativeModel]] = {
    "hill": HillModel,
    "schweighart_sedwick": SchweighartSedwickModel,
    "schweighart_sedwick_nodal": SchweighartSedwickNodalModel,
    "j2_gradient": J2GradientModel,
    "j2_mean_motion": J2MeanMotionModel,
    "tschauner_hempel": TschaunerHempelModel,
    "yamanaka_ankersen": TschaunerHempelModel,  # by the authors of its transition matrix
    "relative_elements": RelativeElementsModel,
    "gim_alfriend": GimAlfriendModel,
    "nonlinear": NonlinearModel,
    "oblate": OblateModel,
    "nonlinear_j2": OblateModel,  # in filters, which integrate both satellites
}
"""By the name that scenarios give; two models go by two names each."""
MODELS.update(load_plugins("models", RelativeModel, MODELS))
