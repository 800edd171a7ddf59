"""Finite-time state-dependent Riccati equation."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.control.finite_horizon import FiniteHorizonController, FiniteHorizonParameters, Plan, Task
from formation_gnc.control.fixed_endpoint_lq import FACTORISATIONS, Cost, discretised, state_dependent, steer
from formation_gnc.parameters import parameter


@dataclass(frozen=True)
class SdreFiniteParameters(FiniteHorizonParameters):
    """And the factorisation."""

    factorisation: str = parameter(
        "sdc1",
        choices=tuple(FACTORISATIONS),
        in_flight=True,
        doc="A(x) x of the equations of motion: about any chief (sdc1) or a circular one (sdc2)",
    )


class FiniteSdre(FiniteHorizonController):
    """SDRE with a given end: the linear problem of A(x) as it is now, solved again and again (Joshi 5.2).

    With matrices frozen at the state of now, the Hamiltonian's transition matrix over the time to go gives
    the co-state that leads to the goal, (5.13)-(5.16) with the sign of (5.11) corrected. The plan is only as
    good as the frozen matrices: it is the re-planning that meets the goal.

    Assumes: matrices that change little over the time to go; what the model assumes.
    """

    Parameters = SdreFiniteParameters

    def plan(self, task: Task) -> Plan:
        """The linear problem of now."""
        a, b = state_dependent(task.model, self._parameters.factorisation, np.array([task.time]))(task.state[None])
        phi, gamma = discretised(np.repeat(a, 3, axis=0), np.repeat(b, 3, axis=0), task.step)
        found = steer(
            np.broadcast_to(phi, (task.steps, 6, 6)),
            np.broadcast_to(gamma, (task.steps, 6, 3)),
            task.state,
            task.goal,
            Cost(np.zeros((6, 6)), task.step * task.effort, task.slack),
        )
        return Plan(found.inputs, task.duration)
