"""Approximating sequence of Riccati equations (ASRE)."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.control.finite_horizon import FiniteHorizonController
from formation_gnc.control.fixed_endpoint_lq import Cost, approximating_sequence, state_dependent
from formation_gnc.control.plan import Plan, Task
from formation_gnc.control.sdre_finite import SdreFiniteParameters
from formation_gnc.parameters import parameter

TOLERANCE = 1e-6
"""Change of the trajectory, relative to the distance from start to goal, that counts as convergence."""


@dataclass(frozen=True)
class AsreParameters(SdreFiniteParameters):
    """Those of finite-horizon SDRE, and the bound on the sequence."""

    max_iterations: int = parameter(
        20, minimum=1, maximum=100, in_flight=True, doc="linear problems without convergence that fail a plan"
    )


class Asre(FiniteHorizonController[AsreParameters]):
    """Sequence of fixed end-point LQ problems, each with A(x) along the trajectory of the previous one (Owis).

    The first trajectory is the straight line from start to goal. At convergence the trajectory solves the
    nonlinear equations and meets the goal. It is suboptimal: the costate equation neglects the derivative of
    A(x).

    Assumes: the model's assumptions.
    """

    Parameters = AsreParameters

    def plan(self, task: Task) -> Plan:
        """Solve linear problems until the trajectory converges."""
        times = np.asarray(task.time + 0.5 * task.step * np.arange(2 * task.steps + 1))
        change = task.goal - task.state
        distance = max(float(np.linalg.norm(change[:3])), task.duration * float(np.linalg.norm(change[3:])), 1.0)
        sequence = approximating_sequence(
            state_dependent(task.model, self.parameters.factorisation, times),
            task.state + np.linspace(0.0, 1.0, task.steps + 1)[:, None] * change,
            task.goal,
            task.duration,
            Cost(np.zeros((6, 6)), task.step * task.effort, task.slack),
            distance * np.repeat([1.0, 1.0 / task.duration], 3),
            TOLERANCE,
            self.parameters.max_iterations,
        )
        failure = ""
        if not sequence.converged:
            failure = f"not converged in {len(sequence.changes)} iterations: last change {sequence.changes[-1]:.1e}"
        return Plan(sequence.trajectory.inputs, task.duration, len(sequence.changes), failure)
