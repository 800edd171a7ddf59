"""Impulses of least delta-v about a chief of any eccentricity, at times of their own, and the bound that proves it.

With the transition F(t) from now, impulses v_i at t_i null an error e when sum F(t_i)^-1 B v_i = -e. For given times
the least sum of magnitudes per axis is a linear programme, whose dual l makes the primer vector p(t) = B' F(t)^-T l: at
most one in size per axis at the given times. Where it is above one at another, a burn there makes the sum less: times
are added at its peaks. For any l, l . (-e) over the largest size of p is a lower bound on every plan at any times.
"""

import math
from dataclasses import dataclass

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.optimize import nnls

from formation_gnc.control.cone_programme import solver_settings
from formation_gnc.relative.model import INPUT, LinearModel
from formation_gnc.types import Matrix, Vector

POINTS = 48
"""Times a revolution to begin with."""

FINER = 6
"""Division of the intervals beside a peak in each round."""

ROUNDS = 3
"""Of added times: the last are a revolution over 48 * 6^3 apart."""

EARLY = 1e-3
"""Price of a burn at the end of the horizon above that of one now: of like ones the first is taken, never put off."""

LATE = 0.1
"""Price of a burn after the deadline above that of one before it: no gain by waiting puts it off again."""

OPTIMALITY = 1e-2
"""Largest excess of the priced sum over its bound that counts as solved, whatever the solver says."""

EXACT = 1e-7
"""Share of the error that burns may leave."""

ENOUGH = 1e-4
"""Largest excess of the primer vector over one that is not worth another time."""

TOGETHER = 500.0
"""Share of a revolution within which impulses are one: neighbours of the last times, between which the best is."""


@dataclass(frozen=True)
class BurnPlan:
    """Impulses that null an error."""

    times: Vector
    """(M,) from now, in order, s."""
    impulses: Matrix
    """(M, 3) delta-v, Hill frame, m/s."""
    least: float
    """Lower bound on the delta-v of any plan until the deadline, else the horizon, sum over the axes, m/s."""

    @property
    def delta_v(self) -> float:
        """Sum over the axes, m/s."""
        return float(np.abs(self.impulses).sum())


def least_burns(
    model: LinearModel, time: float, error: Vector, horizon: float, axes: Vector, deadline: float = math.inf
) -> BurnPlan:
    """Impulses on some axes that null an error within a horizon (s), of least sum over the axes.

    Args:
        model: motion of the error.
        time: now, in the model's time, s.
        error: (6,) now, Hill frame, m and m/s.
        horizon: s.
        deadline: time from now, s, after which a burn is dearer by the share `LATE`.
        axes: (3,) zero where there is no thrust; without any across the track that motion is left alone.

    Raises:
        ArithmeticError: no solution, or one that does not null the error.
    """
    rate = 2.0 * np.pi / model.period
    unit, scale = np.repeat([1.0, rate], 3), max(float(np.abs(error / np.repeat([1.0, rate], 3)).max()), 1e-9)
    wanted, used = -error / unit / scale, np.flatnonzero(axes)
    rows = np.array([0, 1, 3, 4] if not axes[2] > 0.0 else range(6))
    spacing = model.period / POINTS
    times = np.linspace(0.0, horizon, max(2, round(horizon / spacing)) + 1)
    effects = _effects(model, time, times, unit)[:, :, used]
    for remaining in reversed(range(ROUNDS + 1)):
        forced = effects[:, rows].transpose(1, 0, 2).reshape(len(rows), -1)
        price = 1.0 + EARLY / horizon * times + LATE * (times > deadline)
        dual, magnitudes = _least_sum(forced, wanted[rows], np.repeat(price, len(used)))
        primer = np.abs(np.einsum("r,mra->ma", dual, effects[:, rows])).max(axis=1)
        worth = primer / price
        beside = np.pad(worth, 1)
        peaks = np.flatnonzero((worth >= beside[:-2]) & (worth >= beside[2:]))
        peaks = peaks[worth[peaks] > 1.0 - 10.0 * ENOUGH] if remaining else peaks[:0]
        added = _beside(times, peaks, horizon / len(times) / FINER**ROUNDS)
        if not len(added):
            break
        more = _effects(model, time, added, unit)[:, :, used]
        times, order = np.unique(np.concatenate([times, added]), return_index=True)
        effects = np.concatenate([effects, more])[order]
    impulses = np.zeros((len(times), 3))
    impulses[:, used] = (_few(forced, wanted[rows], magnitudes) * scale * rate).reshape(len(times), len(used))
    left = np.einsum("mra,ma->r", effects[:, rows], impulses[:, used]) / (scale * rate) - wanted[rows]
    if not np.abs(left).max() < EXACT:
        raise ArithmeticError(f"burns leave {np.abs(left).max():.1e} of the error")
    burning = np.abs(impulses).sum(axis=1) > 1e-9 * rate * scale
    least = float(dual @ wanted[rows]) / max(float(primer[times <= deadline].max()), 1e-300) * scale * rate
    priced = float(dual @ wanted[rows]) / max(float(worth.max()), 1e-300) * scale * rate
    if not float(price @ np.abs(impulses).sum(axis=1)) <= priced * (1.0 + OPTIMALITY):
        raise ArithmeticError(f"burns of {np.abs(impulses).sum():.4g} m/s beside a least of {least:.4g} m/s")
    return BurnPlan(*_merged(times[burning], impulses[burning], model.period / TOGETHER), least)


def _least_sum(forced: Matrix, wanted: Vector, price: Vector) -> tuple[Vector, Vector]:
    """Dual (R,) and solution (C,) of the least sum of price |x| with A x = b, for A (R, C); raises ArithmeticError.

    What the solver reaches short of its accuracy is judged by the bound that it gives.
    """
    columns = sparse.csc_matrix(np.vstack([forced.T, -forced.T]))
    cones = [clarabel.NonnegativeConeT(columns.shape[0])]
    zero, bound = sparse.csc_matrix((len(wanted), len(wanted))), np.concatenate([price, price])
    found = clarabel.DefaultSolver(zero, -wanted, columns, bound, cones, solver_settings()).solve()
    if found.status not in (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved):
        raise ArithmeticError(f"no burns: {found.status}")
    multipliers = np.array(found.z)
    return np.array(found.x), multipliers[: forced.shape[1]] - multipliers[forced.shape[1] :]


def _few(forced: Matrix, wanted: Vector, solution: Vector) -> Vector:
    """The solution with no more columns than rows: of those that an interior point shares it among, exactly."""
    sizes = np.abs(solution)
    result = np.zeros(len(solution))
    for least in (1e-5, 1e-8, 0.0):  # as few as will do
        shared = np.flatnonzero(sizes >= least * sizes.max())
        signs = np.sign(solution[shared])
        found, left = nnls(forced[:, shared] * signs, wanted)
        result[shared] = signs * found
        if left < EXACT:
            break
    return result


def _merged(times: Vector, impulses: Matrix, gap: float) -> tuple[Vector, Matrix]:
    """Times and impulses with those that follow within a gap (s) as one, at their mean time."""
    groups = np.concatenate([[0], np.cumsum(np.diff(times) > gap)]) if len(times) else np.zeros(0, dtype=np.int64)
    sizes = np.abs(impulses).sum(axis=1)
    count = int(groups[-1]) + 1 if len(groups) else 0
    sums, moments = np.bincount(groups, sizes, count), np.bincount(groups, sizes * times, count)
    merged: Matrix = np.stack([np.bincount(groups, each, count) for each in impulses.T], axis=1)
    return np.asarray(moments / sums, dtype=np.float64), merged


def _effects(model: LinearModel, time: float, times: Vector, unit: Vector) -> Matrix:
    """(M, 6, 3) effect of impulses at times (M,) on the state now, in units of the state."""
    scaled = model.transitions(time, times) * (unit / unit[:, None])
    return np.asarray(np.linalg.solve(scaled, np.broadcast_to(INPUT, (len(times), 6, 3))), dtype=np.float64)


def _beside(times: Vector, peaks: NDArray[np.int_], closest: float) -> Vector:
    """Times that divide the intervals on both sides of those with an index, unless they are close already."""
    added = []
    for index in peaks.tolist():
        for begin in (index - 1, index):
            if 0 <= begin < len(times) - 1 and times[begin + 1] - times[begin] > closest:
                added.append(np.linspace(times[begin], times[begin + 1], FINER + 1)[1:-1])
    return np.unique(np.concatenate(added)) if added else np.zeros(0)
