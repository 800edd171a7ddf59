"""Model predictive static programming as a control law."""

from abc import abstractmethod
from dataclasses import dataclass, replace

import numpy as np

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller import Vehicle
from formation_gnc.control.finite_horizon import FiniteHorizonController, FiniteHorizonParameters, Plan, Task
from formation_gnc.control.riccati import Weights, stationary_gain
from formation_gnc.control.static_programming import STAGES, StaticPlan, mpsp, regulated
from formation_gnc.parameters import parameter
from formation_gnc.relative.hill import HillModel
from formation_gnc.types import Vector

TOLERANCE = 1e-3
"""Terminal error that counts as none, in units of `position_error` and `velocity_error`."""


@dataclass(frozen=True)
class StaticProgrammingParameters(FiniteHorizonParameters):
    """Those of every finite horizon, and a bound on the rounds."""

    most_iterations: int = parameter(
        10, minimum=1, maximum=100, in_flight=True, doc="rounds after which a plan has failed"
    )


class StaticProgrammingController(FiniteHorizonController):
    """What MPSP and G-MPSP share: LQR's history on Hill's equations as the first guess (Joshi 6.1.1), and the
    rest of the plan before as every later one."""

    def __init__(self, parameters: StaticProgrammingParameters, common: CommonParameters, vehicle: Vehicle) -> None:
        """Design the law that holds; raises DesignError as every finite horizon."""
        super().__init__(parameters, common, vehicle)
        self._hill = HillModel(common.mean_motion)
        self._cost = parameters.state_matrix(), vehicle.mass**2 * parameters.thrust_matrix()
        self._tolerance = TOLERANCE * np.array(parameters.position_error + parameters.velocity_error)

    def plan(self, task: Task) -> Plan:
        """The plan of least effort; an axis that has no thrust gets none."""
        if task.guess is None:
            weights = Weights.scaled(*self._cost, task.step)
            gain = stationary_gain(*self._hill.discretise(0.0, task.step), weights)
            task = replace(task, guess=regulated(task, self._hill, gain))
        return self.program(task, self._tolerance, self._parameters.most_iterations)

    @abstractmethod
    def program(self, task: Task, tolerance: Vector, most_iterations: int) -> StaticPlan:
        """Run the rounds."""


@dataclass(frozen=True)
class MpspParameters(StaticProgrammingParameters):
    """Those of static programming, and how the path is predicted."""

    prediction: str = parameter(
        "rk4",
        choices=tuple(STAGES),
        in_flight=True,
        doc="step of the prediction: Runge-Kutta of order four, or Euler's, which takes steps of seconds",
    )


class MpspController(StaticProgrammingController):
    """MPSP: least effort with a hard final state, on a nonlinear model discretised in time (Joshi 6).

    Planned anew as it flies, from the estimate of then, so that the error of the first estimates does not
    remain in the final state.

    Assumes: thrust within its limit; a plan that asks more does not fly.
    """

    Parameters = MpspParameters

    def program(self, task: Task, tolerance: Vector, most_iterations: int) -> StaticPlan:
        """Run MPSP."""
        return mpsp(task, tolerance, most_iterations, self._parameters.prediction)
