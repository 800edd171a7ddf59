"""Finite-horizon state-dependent Riccati equation (SDRE) control."""

from dataclasses import dataclass

import numpy as np

from formation_gnc.control.finite_horizon import FiniteHorizonController, FiniteHorizonParameters
from formation_gnc.control.fixed_endpoint_lq import (
    Cost,
    discretise,
    solve_fixed_endpoint,
    state_dependent,
)
from formation_gnc.control.plan import Plan, Task
from formation_gnc.parameters import parameter
from formation_gnc.relative.factorisation import FACTORISATIONS


@dataclass(frozen=True)
class SdreFiniteParameters(FiniteHorizonParameters):
    """Those of every finite horizon, and the factorisation."""

    factorisation: str = parameter(
        "sdc1",
        choices=tuple(FACTORISATIONS),
        in_flight=True,
        doc="state-dependent coefficients of the equations of motion: any chief orbit (sdc1), circular (sdc2)",
    )


class FiniteSdre(FiniteHorizonController[SdreFiniteParameters]):
    """Finite-horizon SDRE: fixed end-point LQ with A(x) frozen at the current state, replanned (Joshi 5.2).

    The Hamiltonian transition matrix over the time to go yields the costate that reaches the goal,
    (5.13)-(5.16) with the sign of (5.11) corrected. Replanning removes the error of the frozen matrices.

    Assumes: matrices that vary little over the time to go; the model's assumptions.
    """

    Parameters = SdreFiniteParameters

    def plan(self, task: Task) -> Plan:
        """The optimal trajectory of the frozen linear system."""
        a, b = state_dependent(task.model, self.parameters.factorisation, np.array([task.time]))(task.state[None])
        phi, gamma = discretise(np.repeat(a, 3, axis=0), np.repeat(b, 3, axis=0), task.step)
        found = solve_fixed_endpoint(
            np.broadcast_to(phi, (task.steps, 6, 6)),
            np.broadcast_to(gamma, (task.steps, 6, 3)),
            task.state,
            task.goal,
            Cost(np.zeros((6, 6)), task.step * task.effort, task.slack),
        )
        return Plan(found.inputs, task.duration)
