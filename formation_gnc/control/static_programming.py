"""Model predictive static programming, discrete (MPSP, Joshi 6) and generalised to continuous time (G-MPSP, Joshi 7).

Minimum-effort thrust history between two states in a given time, on a nonlinear model of relative motion. Each
iteration predicts the trajectory under the current history, computes the sensitivities of the terminal state
to the thrust backwards along it, and updates the history in closed form: least effort that cancels the
terminal error to first order. At convergence the first-order optimality conditions hold.

What is to be reached is the goal itself, or outputs Y = h(X) of it, fewer than the states or as many.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from formation_gnc.control.plan import Plan, Task
from formation_gnc.relative.model import INPUT, RelativeModel
from formation_gnc.types import Matrix, Vector

MIN_EIGENVALUE = 1e-9
"""Smallest eigenvalue of A_lambda, normalised to a unit diagonal, at which it counts as regular."""

STAGES = {"euler": ((0.0, 1.0),), "rk4": ((0.0, 1 / 6), (0.5, 1 / 3), (0.5, 1 / 3), (1.0, 1 / 6))}
"""Node and weight of each stage of an integration step; a stage uses the rate of the previous one."""

BY_STATE, BY_ACCELERATION = np.eye(6, 9), np.hstack([np.zeros((6, 6)), INPUT])
"""(6, 9) derivatives with respect to the state at the start of a step and the acceleration held over it."""


@dataclass(frozen=True, kw_only=True)
class StaticPlan(Plan):
    """Result of the iterations."""

    history: Matrix
    """Decision variables. MPSP: `acceleration` itself. G-MPSP: (2 N + 1, 3) acceleration at the ends and
    middles of N steps; `acceleration` is held over parts of the steps and reaches the same state."""
    errors: Matrix
    """(iterations + 1, p) terminal error of the guess and after each iteration: of the state, or of the outputs."""


Prediction = tuple[Matrix, Callable[[], Matrix]]
"""Predicted terminal state, and a function for its sensitivities (M, 6, 3) to each acceleration, per second."""

Output = Callable[[Vector], tuple[Vector, Matrix]]
"""h(X) (p,) of a state (6,), and its derivative (p, 6): Joshi (6.2), (7.2), (7.11)."""


def mpsp(
    task: Task,
    tolerance: Vector,
    max_iterations: int = 20,
    method: str = "rk4",
    output: Output | None = None,
) -> StaticPlan:
    """MPSP, Joshi (6.1)-(6.11), from the task's guess or zero thrust.

    The sensitivities are the exact derivatives of the integration step, "rk4" or "euler" (6.14). Joshi
    predicts with RK4 and differentiates Euler's step, which differs little at his step of 1 s.

    Args:
        task: its steps are those of the discrete model.
        tolerance: (p,) admissible terminal error.
        max_iterations: bound on the iterations.
        method: key of `STAGES`.
        output: what of the goal is to be reached; all of it by default.
    """
    guess = np.zeros((task.steps, 3)) if task.guess is None else task.guess

    def predict(history: Matrix) -> Prediction:
        states, slopes = np.empty((task.steps + 1, 6)), np.empty((task.steps, 6, 9))
        states[0] = task.state
        for k in range(task.steps):
            states[k + 1], slopes[k] = advance(
                task.model, task.time + k * task.step, states[k], history[k], task.step, method
            )

        def sensitivities() -> Matrix:
            result, to_end = np.empty((task.steps, 6, 3)), np.eye(6)
            for k in reversed(range(task.steps)):
                result[k] = to_end @ slopes[k, :, 6:] / task.step
                to_end = to_end @ slopes[k, :, :6]
            return result

        return states[-1], sensitivities

    shares = np.full(task.steps, task.step)
    history, errors, failure, _ = _solve(task, guess, predict, shares, tolerance, max_iterations, output)
    return StaticPlan(history, task.duration, len(errors) - 1, failure, history=history, errors=errors)


def gmpsp(
    task: Task, tolerance: Vector, max_iterations: int = 20, pieces: int = 2, output: Output | None = None
) -> StaticPlan:
    """G-MPSP, Joshi (7.1)-(7.23), from the task's guess or zero thrust; arguments as for `mpsp`.

    `pieces` is the number of equal parts of a step over which the result is held.

    The weighting matrix W is integrated backwards in continuous time (7.10)-(7.11); the integrals A_lambda and
    b_lambda (7.19)-(7.20) use Simpson's rule, of order four like the prediction.
    """
    count = 2 * task.steps + 1
    guess = np.zeros((task.steps, 3)) if task.guess is None else task.guess
    knots = 2.0 * np.arange(task.steps) + 1.0
    start = np.stack([np.interp(np.arange(count), knots, axis) for axis in guess.T], axis=-1)
    times = task.time + 0.5 * task.step * np.arange(count)
    shares = task.step / 6.0 * np.convolve(np.tile([1.0, 0.0], task.steps), [1.0, 4.0, 1.0])[:count]

    def predict(history: Matrix) -> Prediction:
        def rate(k: int, state: Vector) -> Vector:
            return task.model.motion(times[k], state, history[k])[0]

        states = np.empty((count, 6))
        states[0] = task.state
        for k in range(0, count - 1, 2):
            states[k + 1], states[k + 2] = _rk4_step(rate, k, 1, states[k], task.step)

        def sensitivities() -> Matrix:
            slopes = [task.model.motion(*each)[1] for each in zip(times, states, strict=True)]

            def adjoint_rate(k: int, matrix: Matrix) -> Matrix:
                return np.asarray(-matrix @ slopes[k])

            weighting = np.empty((count, 6, 6))
            weighting[-1] = np.eye(6)
            for k in range(count - 1, 0, -2):
                weighting[k - 1], weighting[k - 2] = _rk4_step(adjoint_rate, k, -1, weighting[k], -task.step)
            return weighting @ INPUT

        return states[-1], sensitivities

    history, errors, failure, sensitivity = _solve(task, start, predict, shares, tolerance, max_iterations, output)
    held = history[:-1] if sensitivity is None else _held(task, history, sensitivity, shares, pieces)
    return StaticPlan(held, task.duration, len(errors) - 1, failure, history=history, errors=errors)


def _held(task: Task, history: Matrix, sensitivity: Matrix, shares: Vector, pieces: int) -> Matrix:
    """(pieces N, 3) accelerations held over pieces of the steps that reach what the continuous (2 N + 1, 3) one does.

    Its means, with the least change that makes up for the position which a hold loses.
    """
    held, response = _means(history, pieces), _means(sensitivity, pieces)
    lengths = np.full(len(held), task.step / pieces)
    reached = np.einsum("k,kij,kj->i", shares, sensitivity, history)
    lost = np.einsum("k,kij,kj->i", lengths, response, held) - reached
    rigid = replace(task, slack=np.zeros((len(lost), len(lost))))
    change = _update(rigid, response, lengths, np.zeros_like(held), lost)
    return held if change is None else held + change[0]


def _means(values: Matrix, pieces: int) -> Matrix:
    """(pieces N, ...) means over pieces of the parabolas through the ends and middles (2 N + 1, ...) of N steps."""
    s = np.linspace(0.0, 1.0, pieces + 1)[:, None]
    weights = pieces * np.diff(s * [1.0, 0.0, 0.0] + s**2 * [-1.5, 2.0, -0.5] + s**3 / 3.0 * [2.0, -4.0, 2.0], axis=0)
    knots = np.stack([values[:-1:2], values[1::2], values[2::2]], axis=1)
    means: Matrix = np.einsum("pk,nk...->np...", weights, knots)
    return means.reshape(-1, *values.shape[1:])


def lqr_guess(task: Task, model: RelativeModel, gain: Matrix) -> Matrix:
    """(steps, 3) accelerations of an LQR on a linear model: the initial guess of Joshi 6.1.1.

    The gain (3, 6) acts on the error from the free motion that ends at the goal.
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
    """State (6,) after a step of held acceleration, and its derivatives (6, 9) by state and acceleration."""
    rate, slope = np.zeros(6), np.zeros((6, 9))
    end, spread = state, BY_STATE
    for node, weight in STAGES[method]:
        moment, here = time + node * step, state + node * step * rate
        rate, jacobian = model.motion(moment, here, acceleration)
        slope = jacobian @ (BY_STATE + node * step * slope) + BY_ACCELERATION
        end, spread = end + weight * step * rate, spread + weight * step * slope
    return end, spread


def _rk4_step(
    rate: Callable[[int, Matrix], Matrix], instant: int, direction: int, value: Matrix, step: float
) -> tuple[Matrix, Matrix]:
    """Values at the middle and the end of an RK4 step over two instants in the direction `direction`.

    The middle value is the method's dense output, of order three; the end stays of order four.
    """
    first = rate(instant, value)
    second = rate(instant + direction, value + 0.5 * step * first)
    third = rate(instant + direction, value + 0.5 * step * second)
    fourth = rate(instant + 2 * direction, value + step * third)
    return (
        value + step / 24.0 * (5.0 * first + 4.0 * (second + third) - fourth),
        value + step / 6.0 * (first + 2.0 * (second + third) + fourth),
    )


def _solve(
    task: Task,
    guess: Matrix,
    predict: Callable[[Matrix], Prediction],
    shares: Vector,
    tolerance: Vector,
    max_iterations: int,
    output: Output | None,
) -> tuple[Matrix, Matrix, str, Matrix | None]:
    """Iterate prediction and update until the terminal error is as expected, or the iteration fails.

    At least one update: a guess may reach the goal at far more than the least effort.

    Returns the history, the terminal errors (iterations + 1, p), the reason of failure, if any, and the
    sensitivities of the last update, if any.
    """
    history, expected, errors, sensitivity = guess, np.zeros(len(tolerance)), list[Vector](), None
    with np.errstate(all="ignore"):
        while True:
            end, sensitivities = predict(history)
            errors.append(end - task.goal if output is None else output(end)[0] - output(task.goal)[0])
            failure = ""
            if not task.duration > 0.0:
                failure = f"the final time is past by {abs(task.duration):g} s"
            elif not np.isfinite(errors[-1]).all():
                failure = f"the prediction of iteration {len(errors) - 1} is not finite"
            elif len(errors) > 1 and (np.abs(errors[-1] - expected) <= tolerance).all():
                pass
            elif len(errors) > max_iterations:
                miss = np.linalg.norm(errors[-1][:3])
                failure = f"{max_iterations} iterations leave {miss:.3g} m at the final time"
            else:
                sensitivity, own = sensitivities(), task
                if output is not None:
                    slope = output(end)[1]
                    sensitivity, own = slope @ sensitivity, replace(task, slack=slope @ task.slack @ slope.T)
                update = _update(own, sensitivity, shares, history, errors[-1])
                if update is not None:
                    history, expected = update
                    continue
                failure = "A_lambda is singular: not every terminal state is reachable"
            return history, np.array(errors), failure, sensitivity


def _update(
    task: Task, sensitivity: Matrix, shares: Vector, history: Matrix, error: Vector
) -> tuple[Matrix, Vector] | None:
    """Least-effort history that cancels the terminal error to first order, Joshi (6.11), (7.23).

    Returns it with the expected terminal error, zero without slack; None if A_lambda is singular or not
    finite. The sensitivities are per unit of the quadrature weights `shares`, s.
    """
    scaled = sensitivity @ _inverse_effort(task.effort)
    a_lambda = np.einsum("k,kij,klj->il", shares, scaled, sensitivity) + task.slack
    b_lambda = np.einsum("k,kij,kj->i", shares, sensitivity, history)
    size = np.sqrt(np.diag(a_lambda))
    normal = a_lambda / np.outer(size, size)
    if not np.isfinite(normal).all() or np.linalg.eigvalsh(normal)[0] < MIN_EIGENVALUE:
        return None
    multiplier = np.linalg.solve(normal, (b_lambda - error) / size) / size
    updated: Matrix = np.einsum("kij,i->kj", scaled, multiplier)
    return updated, -task.slack @ multiplier


def _inverse_effort(effort: Matrix) -> Matrix:
    """(3, 3) inverse of R; zero for an axis without thrust, whose element of R is infinite."""
    result, pushes = np.zeros((3, 3)), np.isfinite(np.diag(effort))
    result[np.ix_(pushes, pushes)] = np.linalg.inv(effort[np.ix_(pushes, pushes)])
    return result
