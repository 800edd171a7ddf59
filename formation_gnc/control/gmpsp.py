"""Generalised model predictive static programming (G-MPSP) as a control law."""

from formation_gnc.control.mpsp import StaticProgrammingController, StaticProgrammingParameters
from formation_gnc.control.plan import Task
from formation_gnc.control.static_programming import StaticPlan, gmpsp


class GmpspController(StaticProgrammingController[StaticProgrammingParameters]):
    """G-MPSP: minimum effort with terminal constraint, in continuous time (Joshi 7).

    As MPSP, with thrust that varies within a step, so that `step` may be longer.

    Assumes: thrust within its limit; a plan beyond it is rejected.
    """

    Parameters = StaticProgrammingParameters

    def solve(self, task: Task) -> StaticPlan:
        """G-MPSP iterations; the plan is held over ticks if a step is a whole number of them, else over half steps."""
        ticks = round(task.step / self._tick)
        whole = ticks > 0 and abs(task.step - ticks * self._tick) <= 1e-9 * task.step
        return gmpsp(task, self.tolerance, self.parameters.max_iterations, ticks if whole else 2)
