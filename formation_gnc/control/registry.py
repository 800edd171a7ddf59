"""All control laws by name: a new law is one file and one line here."""

from formation_gnc.control.coast import Coast
from formation_gnc.control.controller import Controller
from formation_gnc.control.gmpsp import GmpspController
from formation_gnc.control.hinf import HInfinityController
from formation_gnc.control.lqr import LinearQuadraticRegulator
from formation_gnc.control.mpc import ModelPredictiveController
from formation_gnc.control.mpsp import MpspController

ALGORITHMS: dict[str, type[Controller]] = {
    "coast": Coast,
    "lqr": LinearQuadraticRegulator,
    "hinf": HInfinityController,
    "mpc": ModelPredictiveController,
    "mpsp": MpspController,
    "gmpsp": GmpspController,
}
