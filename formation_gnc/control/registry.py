"""All control laws by name: a new law is one file and one line here."""

from typing import Any

from formation_gnc.control.adaptive_lqr import AdaptiveLinearQuadraticRegulator
from formation_gnc.control.asre import Asre
from formation_gnc.control.coast import Coast
from formation_gnc.control.controller import Controller
from formation_gnc.control.convex import Convex
from formation_gnc.control.dynamic_inversion import DynamicInversion
from formation_gnc.control.finite_horizon import FiniteHorizonController
from formation_gnc.control.gmpsp import GmpspController
from formation_gnc.control.hinf import HInfinityController
from formation_gnc.control.impulsive import Impulsive
from formation_gnc.control.lqr import LinearQuadraticRegulator
from formation_gnc.control.mpc import ModelPredictiveController
from formation_gnc.control.mpsp import MpspController
from formation_gnc.control.roe_lyapunov import RoeLyapunov
from formation_gnc.control.sdre import Sdre
from formation_gnc.control.sdre_finite import FiniteSdre
from formation_gnc.control.sliding_mode import SlidingMode
from formation_gnc.plugins import load_plugins

ALGORITHMS: dict[str, type[Controller[Any]]] = {
    "coast": Coast,
    "lqr": LinearQuadraticRegulator,
    "hinf": HInfinityController,
    "mpc": ModelPredictiveController,
    "mpsp": MpspController,
    "gmpsp": GmpspController,
    "sdre": Sdre,
    "sdre_finite": FiniteSdre,
    "asre": Asre,
    "sliding_mode": SlidingMode,
    "dynamic_inversion": DynamicInversion,
    "impulsive": Impulsive,
    "roe_lyapunov": RoeLyapunov,
    "convex": Convex,
    "adaptive_lqr": AdaptiveLinearQuadraticRegulator,
}
ALGORITHMS.update(load_plugins("laws", Controller, ALGORITHMS))

FINITE_HORIZONS = [name for name, law in ALGORITHMS.items() if issubclass(law, FiniteHorizonController)]
"""The laws that complete a reconfiguration at a given final time."""
