"""Model predictive static programming, discrete (Joshi 6) and continuous (Joshi 7).

The thrust history of least effort that carries a state to a desired one at a final time, on a nonlinear
model of relative motion. Each round predicts the path under the history at hand, finds what every thrust does
to the state at the end, backwards along the path, and answers the terminal error in closed form by the
history of least effort that cancels it to first order. Where the rounds end, the first-order conditions of
the optimum hold.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from formation_gnc.control.finite_horizon import Plan, Task
from formation_gnc.relative.model import INPUT, RelativeModel
from formation_gnc.types import Matrix, Vector

SINGULAR = 1e-9
"""Least eigenvalue of A_lambda, each of its states in units of its own reach, above which it can be solved
for."""

STAGES = {"euler": ((0.0, 1.0),), "rk4": ((0.0, 1 / 6), (0.5, 1 / 3), (0.5, 1 / 3), (1.0, 1 / 6))}
"""Node and weight of each stage of a step; a stage starts from the rate of the one before."""

BY_STATE, BY_ACCELERATION = np.eye(6, 9), np.hstack([np.zeros((6, 6)), INPUT])
"""(6, 9) derivatives by the state at the start of a step and the acceleration held over it."""


@dataclass(frozen=True, kw_only=True)
class StaticPlan(Plan):
    """What the rounds have ended with."""

    history: Matrix
    """What they worked on. MPSP: `acceleration` itself. G-MPSP: (2 N + 1, 3) the acceleration at the ends and
    middles of N steps; `acceleration` holds it over half steps."""
    errors: Matrix
    """(iterations + 1, 6) terminal error of the guess, and after each round."""


Round = tuple[Matrix, Callable[[], Matrix]]
"""Predicted state at the end, and what gives its sensitivities (M, 6, 3) to each acceleration, per second."""


def mpsp(task: Task, tolerance: Vector, most_iterations: int = 20, method: str = "rk4") -> StaticPlan:
    """MPSP: Joshi (6.1)-(6.11), from the task's guess or no thrust.

    The sensitivities are the exact derivatives of the step that predicts, "rk4" or "euler" (6.14); Joshi
    predicts with the one and differentiates the other, which at his step of 1 s is nearly the same.

    Args:
        task: its steps are those of the discrete model.
        tolerance: (6,) largest terminal error that counts as none.
        most_iterations: rounds after which the plan has failed.
        method: key of `STAGES`.
    """
    guess = np.zeros((task.steps, 3)) if task.guess is None else task.guess

    def predict(history: Matrix) -> Round:
        path, slopes = np.empty((task.steps + 1, 6)), np.empty((task.steps, 6, 9))
        path[0] = task.state
        for k in range(task.steps):
            path[k + 1], slopes[k] = advance(
                task.model, task.time + k * task.step, path[k], history[k], task.step, method
            )

        def sensitivities() -> Matrix:
            result, onward = np.empty((task.steps, 6, 3)), np.eye(6)
            for k in reversed(range(task.steps)):
                result[k] = onward @ slopes[k, :, 6:] / task.step
                onward = onward @ slopes[k, :, :6]
            return result

        return path[-1], sensitivities

    history, errors, failure = _solve(task, guess, predict, np.full(task.steps, task.step), tolerance, most_iterations)
    return StaticPlan(history, task.duration, len(errors) - 1, failure, history=history, errors=errors)


def gmpsp(task: Task, tolerance: Vector, most_iterations: int = 20) -> StaticPlan:
    """G-MPSP: Joshi (7.1)-(7.23), from the task's guess or no thrust; arguments as for `mpsp`.

    The weighting matrix W is integrated backwards in continuous time (7.10)-(7.11), and A_lambda and b_lambda
    are integrals (7.19)-(7.20), here by Simpson's rule: all of order four, like the prediction.
    """
    count = 2 * task.steps + 1
    guess = np.zeros((task.steps, 3)) if task.guess is None else task.guess
    knots = 2.0 * np.arange(task.steps) + 1.0
    start = np.stack([np.interp(np.arange(count), knots, axis) for axis in guess.T], axis=-1)
    times = task.time + 0.5 * task.step * np.arange(count)
    shares = task.step / 6.0 * np.convolve(np.tile([1.0, 0.0], task.steps), [1.0, 4.0, 1.0])[:count]

    def predict(history: Matrix) -> Round:
        def rate(k: int, state: Vector) -> Vector:
            return task.model.motion(times[k], state, history[k])[0]

        states = np.empty((count, 6))
        states[0] = task.state
        for k in range(0, count - 1, 2):
            states[k + 1], states[k + 2] = _two_instants(rate, k, 1, states[k], task.step)

        def sensitivities() -> Matrix:
            slopes = [task.model.motion(*each)[1] for each in zip(times, states, strict=True)]

            def turn(k: int, matrix: Matrix) -> Matrix:
                return np.asarray(-matrix @ slopes[k])

            weighting = np.empty((count, 6, 6))
            weighting[-1] = np.eye(6)
            for k in range(count - 1, 0, -2):
                weighting[k - 1], weighting[k - 2] = _two_instants(turn, k, -1, weighting[k], -task.step)
            return weighting @ INPUT

        return states[-1], sensitivities

    history, errors, failure = _solve(task, start, predict, shares, tolerance, most_iterations)
    held = 0.5 * (history[:-1] + history[1:])
    return StaticPlan(held, task.duration, len(errors) - 1, failure, history=history, errors=errors)


def regulated(task: Task, model: RelativeModel, gain: Matrix) -> Matrix:
    """(steps, 3) accelerations that LQR would give on a linear model: the guess of Joshi 6.1.1.

    The gain (3, 6) is on the error against the goal's free motion, at the start of every step.
    """
    history = np.empty((task.steps, 3))
    error = task.state - model.propagate(task.time + task.duration, task.goal, -task.duration)
    phi, gamma = model.discretise(task.time, task.step)
    for k in range(task.steps):
        history[k] = -gain @ error
        error = phi @ error + gamma @ history[k]
    return history


def advance(
    model: RelativeModel, time: float, state: Vector, acceleration: Vector, step: float, method: str
) -> tuple[Vector, Matrix]:
    """State after a step under a held acceleration, and its derivatives (6, 9) by state and acceleration."""
    rate, slope = np.zeros(6), np.zeros((6, 9))
    end, spread = state, BY_STATE
    for node, weight in STAGES[method]:
        moment, here = time + node * step, state + node * step * rate
        rate, jacobian = model.motion(moment, here, acceleration)
        slope = jacobian @ (BY_STATE + node * step * slope) + BY_ACCELERATION
        end, spread = end + weight * step * rate, spread + weight * step * slope
    return end, spread


def _two_instants(
    rate: Callable[[int, Matrix], Matrix], instant: int, onward: int, value: Matrix, step: float
) -> tuple[Matrix, Matrix]:
    """Values at the middle and the end of a Runge-Kutta step of order four, two instants onward.

    In the middle stands the cubic that goes with the method: of order three there, which costs no order at
    the end.
    """
    first = rate(instant, value)
    second = rate(instant + onward, value + 0.5 * step * first)
    third = rate(instant + onward, value + 0.5 * step * second)
    fourth = rate(instant + 2 * onward, value + step * third)
    return (
        value + step / 24.0 * (5.0 * first + 4.0 * (second + third) - fourth),
        value + step / 6.0 * (first + 2.0 * (second + third) + fourth),
    )


def _solve(
    task: Task,
    guess: Matrix,
    predict: Callable[[Matrix], Round],
    shares: Vector,
    tolerance: Vector,
    most_iterations: int,
) -> tuple[Matrix, Matrix, str]:
    """Predict and correct until the terminal error is what it is to be, or a reason to stop appears.

    It corrects at least once: a guess that arrives may do so at many times the least effort.

    Returns the history, the terminal errors (iterations + 1, 6) and why the history is not to be flown.
    """
    history, wanted, errors = guess, np.zeros(6), list[Vector]()
    with np.errstate(all="ignore"):
        while True:
            end, sensitivities = predict(history)
            errors.append(end - task.goal)
            failure = ""
            if not task.duration > 0.0:
                failure = f"the final time is past by {abs(task.duration):g} s"
            elif not np.isfinite(errors[-1]).all():
                failure = f"the prediction of iteration {len(errors) - 1} is not finite"
            elif len(errors) > 1 and (np.abs(errors[-1] - wanted) <= tolerance).all():
                pass
            elif len(errors) > most_iterations:
                miss = np.linalg.norm(errors[-1][:3])
                failure = f"{most_iterations} iterations leave {miss:.3g} m at the final time"
            else:
                improved = _improved(task, sensitivities(), shares, history, errors[-1])
                if improved is not None:
                    history, wanted = improved
                    continue
                failure = "the sensitivity product is singular: thrust cannot reach every final state"
            return history, np.array(errors), failure


def _improved(
    task: Task, sensitivity: Matrix, shares: Vector, history: Matrix, error: Vector
) -> tuple[Matrix, Vector] | None:
    """The history of least effort that cancels the terminal error to first order: Joshi (6.11), (7.23).

    With it the terminal error to expect, zero without slack. None when A_lambda is singular, or not finite.
    The sensitivities are per unit of `shares`, s.
    """
    softened = sensitivity @ _softness(task.effort)
    reach = np.einsum("k,kij,klj->il", shares, softened, sensitivity) + task.slack
    pull = np.einsum("k,kij,kj->i", shares, sensitivity, history)
    size = np.sqrt(np.diag(reach))
    normal = reach / np.outer(size, size)  # free of units
    if not np.isfinite(normal).all() or np.linalg.eigvalsh(normal)[0] < SINGULAR:
        return None
    multiplier = np.linalg.solve(normal, (pull - error) / size) / size
    improved: Matrix = np.einsum("kij,i->kj", softened, multiplier)
    return improved, -task.slack @ multiplier


def _softness(effort: Matrix) -> Matrix:
    """Inverse (3, 3) of R; zero for an axis without thrust, whose element is infinite."""
    result, pushes = np.zeros((3, 3)), np.isfinite(np.diag(effort))
    result[np.ix_(pushes, pushes)] = np.linalg.inv(effort[np.ix_(pushes, pushes)])
    return result
