"""Approximating sequence of Riccati equations."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.control.finite_horizon import Plan, Task
from formation_gnc.control.fixed_endpoint_lq import Cost, approximating_sequence, state_dependent
from formation_gnc.control.sdre_finite import FiniteSdre, SdreFiniteParameters
from formation_gnc.parameters import parameter

TOLERANCE = 1e-6
"""Change of the way, over the distance from start to goal, at which a sequence has converged."""


@dataclass(frozen=True)
class AsreParameters(SdreFiniteParameters):
    """And the bound of the sequence."""

    most_iterations: int = parameter(
        20, minimum=1, maximum=100, in_flight=True, doc="linear problems after which a plan has failed"
    )


class Asre(FiniteSdre):
    """A sequence of linear problems with a given end, each with A(x) along the way of the one before (Owis).

    The first takes the matrices at the states between start and goal on a straight line. When the way stays
    what it was, it solves the nonlinear equations, and the goal is met. It is not the optimum: the co-state's
    equation leaves out how A(x) changes with x.

    Assumes: what the model assumes.
    """

    Parameters = AsreParameters

    def plan(self, task: Task) -> Plan:
        """Solve linear problems until the way stays what it was."""
        times = np.asarray(task.time + 0.5 * task.step * np.arange(2 * task.steps + 1))
        change = task.goal - task.state
        distance = max(float(np.linalg.norm(change[:3])), task.duration * float(np.linalg.norm(change[3:])), 1.0)
        sequence = approximating_sequence(
            state_dependent(task.model, self._parameters.factorisation, times),
            task.state + np.linspace(0.0, 1.0, task.steps + 1)[:, None] * change,
            task.goal,
            task.duration,
            Cost(np.zeros((6, 6)), task.step * task.effort, task.slack),
            distance * np.repeat([1.0, 1.0 / task.duration], 3),
            TOLERANCE,
            self._parameters.most_iterations,
        )
        failure = ""
        if not sequence.converged:
            failure = f"not converged in {len(sequence.changes)} iterations: {sequence.changes[-1]:.1e} is left"
        return Plan(sequence.steering.inputs, task.duration, len(sequence.changes), failure)
