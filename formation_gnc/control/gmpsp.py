"""Generalised model predictive static programming as a control law."""

from formation_gnc.control.finite_horizon import Task
from formation_gnc.control.mpsp import StaticProgrammingController, StaticProgrammingParameters
from formation_gnc.control.static_programming import StaticPlan, gmpsp
from formation_gnc.types import Vector


class GmpspController(StaticProgrammingController):
    """G-MPSP: least effort with a hard final state, in continuous time (Joshi 7).

    As MPSP, with a thrust that varies over a step: `step` may be longer. It is flown as its mean over every
    tick.

    Assumes: thrust within its limit; a plan that asks more does not fly.
    """

    Parameters = StaticProgrammingParameters

    def program(self, task: Task, tolerance: Vector, most_iterations: int) -> StaticPlan:
        """Run G-MPSP."""
        return gmpsp(task, tolerance, most_iterations)
