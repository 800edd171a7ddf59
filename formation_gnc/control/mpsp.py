"""Model predictive static programming (MPSP) as a control law."""

from abc import abstractmethod
from dataclasses import dataclass, replace

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Vehicle
from formation_gnc.control.finite_horizon import FiniteHorizonController, FiniteHorizonParameters
from formation_gnc.control.plan import Plan, Task
from formation_gnc.control.riccati import Weights, stationary_gain
from formation_gnc.control.static_programming import STAGES, StaticPlan, lqr_guess, mpsp
from formation_gnc.parameters import parameter
from formation_gnc.relative.hill import HillModel

TOLERANCE = 1e-3
"""Admissible terminal error, in units of `position_error` and `velocity_error`."""


@dataclass(frozen=True)
class StaticProgrammingParameters(FiniteHorizonParameters):
    """Those of every finite horizon, and a bound on the iterations."""

    max_iterations: int = parameter(
        10, minimum=1, maximum=100, in_flight=True, doc="iterations without convergence that fail a plan"
    )


class StaticProgrammingController[P: StaticProgrammingParameters](FiniteHorizonController[P]):
    """Base of MPSP and G-MPSP: the initial guess is an LQR on Hill's equations (Joshi 6.1.1), afterwards the
    remainder of the previous plan.

    A subclass implements `solve`.
    """

    def __init__(self, parameters: P, common: CommonParameters, vehicle: Vehicle) -> None:
        """Design the holding LQR; raises DesignError as every finite horizon."""
        super().__init__(parameters, common, vehicle)
        self._hill = HillModel(common.mean_motion)
        self._cost = parameters.state_matrix(), vehicle.mass**2 * parameters.thrust_matrix()
        self.tolerance = TOLERANCE * np.array(parameters.position_error + parameters.velocity_error)

    def plan(self, task: Task) -> Plan:
        """The minimum-effort plan; an axis without thrust stays at zero."""
        if task.guess is None:
            weights = Weights.scaled(*self._cost, task.step)
            gain = stationary_gain(*self._hill.discretise(0.0, task.step), weights)
            task = replace(task, guess=lqr_guess(task, self._hill, gain))
        return self.solve(task)

    @abstractmethod
    def solve(self, task: Task) -> StaticPlan:
        """Iterate from the task's guess to the `tolerance` (6,) on the terminal error."""


@dataclass(frozen=True)
class MpspParameters(StaticProgrammingParameters):
    """Those of static programming, and the integration method."""

    prediction: str = parameter(
        "rk4",
        choices=tuple(STAGES),
        in_flight=True,
        doc="integration of the prediction: Runge-Kutta of order four, or Euler, which needs steps of seconds",
    )


class MpspController(StaticProgrammingController[MpspParameters]):
    """MPSP: minimum effort with terminal constraint, on a nonlinear model discretised in time (Joshi 6).

    Replanning from the current estimate keeps the error of early estimates out of the final state.

    Assumes: thrust within its limit; a plan beyond it is rejected.
    """

    Parameters = MpspParameters

    def solve(self, task: Task) -> StaticPlan:
        """MPSP iterations."""
        return mpsp(task, self.tolerance, self.parameters.max_iterations, self.parameters.prediction)
