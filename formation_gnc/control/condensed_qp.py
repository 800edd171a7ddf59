"""The quadratic programme of model predictive control, in the forces alone."""

from dataclasses import dataclass
from functools import cache
from math import sqrt

import numpy as np

from formation_gnc.types import Matrix, Vector


@dataclass(frozen=True)
class CondensedQp:
    """The quadratic programme from one place of the orbit, in forces over the thrust limit."""

    steps: Matrix
    """(N, 6, 6) transition of each step."""
    free: Matrix
    """(6 N, 6) states at the ends of the steps, from the state at the start."""
    forced: Matrix
    """(6 N, 3 M) the same from the forces."""
    weight: Matrix
    """(N, 6, 6) weight of the error at the end of each step."""
    hessian: Vector
    """Upper triangle, column by column, scaled."""
    gradient: Matrix
    """(3 M, 6 N) scaled gradient from the error of free motion."""
    gradient_of_state: Matrix
    """(3 M, 6) the same from the error at the start."""
    cost_of_state: Matrix
    """(6, 6) cost of free motion from the error at the start."""
    price: float | Vector
    """Scaled linear cost of the forces' magnitudes."""
    scale: float
    """Scaled cost over cost."""

    @classmethod
    def condensed(
        cls, phi: Matrix, gamma: Matrix, steps: int, running: Matrix, end: Matrix, thrust: Matrix, cost: str
    ) -> "CondensedQp":
        """Eliminate the states: phi (N, 6, 6) and gamma (N, 6, 3) per step, weights of error and force."""
        horizon, count = len(phi), 3 * steps
        free, forced = np.empty((horizon, 6, 6)), np.empty((horizon, 6, count))
        state, response = np.eye(6), np.zeros((6, count))
        for step in range(horizon):
            state, response = phi[step] @ state, phi[step] @ response
            if step < steps:
                response[:, 3 * step : 3 * step + 3] += gamma[step]
            free[step], forced[step] = state, response
        weight = np.repeat(running[None], horizon, axis=0)
        weight[-1] += end
        weighted = (weight @ forced).reshape(6 * horizon, count)
        unforced = free.reshape(6 * horizon, 6)
        stacked = forced.reshape(6 * horizon, count)
        hessian = stacked.T @ weighted
        price = np.zeros(count)
        if cost == "quadratic":
            hessian += np.kron(np.eye(steps), thrust)
        else:
            price = np.tile(np.sqrt(np.diag(thrust)), steps) / 2.0
        scale = 1.0 / float(np.diag(hessian).mean())
        return cls(
            phi,
            unforced,
            stacked,
            weight,
            scale * hessian.T[np.tril_indices(count)],
            scale * weighted.T,
            scale * weighted.T @ unforced,
            unforced.T @ (weight @ free).reshape(6 * horizon, 6),
            scale * price,
            scale,
        )


@cache
def facet_normals() -> Matrix:
    """(13, 3) axes, face diagonals and space diagonals: half of 26 directions all around."""
    normals = [
        np.array([x, y, z]) / sqrt(x * x + y * y + z * z)
        for x in (1, 0, -1)
        for y in (1, 0, -1)
        for z in (1, 0, -1)
        if (x, y, z) > (0, 0, 0)
    ]
    return np.array(sorted(normals, key=lambda normal: np.count_nonzero(normal)))


@cache
def facet_reach() -> float:
    """Distance of the farthest corner of the polyhedron whose faces are at distance one."""
    normals = np.vstack([facet_normals(), -facet_normals()])
    farthest = 1.0
    for first in range(len(normals)):
        for second in range(first):
            for third in range(second):
                faces = normals[[first, second, third]]
                if abs(np.linalg.det(faces)) > 1e-9:
                    corner = np.linalg.solve(faces, np.ones(3))
                    if (normals @ corner <= 1.0 + 1e-9).all():
                        farthest = max(farthest, float(np.linalg.norm(corner)))
    return farthest
