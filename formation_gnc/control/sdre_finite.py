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
    """Finite-horizon SDRE: fixed end-point LQ with A(x, t) frozen at the current state, replanned (Joshi 5.2).

    The Hamiltonian transition matrix over the time to go yields the costate that reaches the goal,
    (5.13)-(5.16) with the sign of (5.11) corrected. The state is frozen, the chief's motion is not: it is known.
    Replanning removes the error of the frozen state.

    Assumes: a distance much smaller than the chief's radius; the model's assumptions.
    """

    Parameters = SdreFiniteParameters

    def plan(self, task: Task) -> Plan:
        """The optimal trajectory of the linear system at the frozen state."""
        times = np.asarray(task.time + 0.5 * task.step * np.arange(2 * task.steps + 1))
        frozen = np.broadcast_to(task.state, (len(times), 6))
        a, b = state_dependent(task.model, self.parameters.factorisation, times)(frozen)
        cost = Cost(np.zeros((6, 6)), task.step * task.effort, task.slack)
        found = solve_fixed_endpoint(*discretise(a, b, task.step), task.state, task.goal, cost)
        return Plan(found.inputs, task.duration)
