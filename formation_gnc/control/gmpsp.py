"""Generalised model predictive static programming (G-MPSP) as a control law."""

from formation_gnc.control.mpsp import StaticProgrammingController, StaticProgrammingParameters
from formation_gnc.control.plan import Task
from formation_gnc.control.static_programming import StaticPlan, gmpsp


class GmpspController(StaticProgrammingController[StaticProgrammingParameters]):
    """G-MPSP: minimum effort with terminal constraint, in continuous time (Joshi 7).

    As MPSP, with thrust that varies within a step, so that `step` may be longer. Each tick applies its mean.

    Assumes: thrust within its limit; a plan beyond it is rejected.
    """

    Parameters = StaticProgrammingParameters

    def solve(self, task: Task) -> StaticPlan:
        """G-MPSP iterations."""
        return gmpsp(task, self.tolerance, self.parameters.max_iterations)
