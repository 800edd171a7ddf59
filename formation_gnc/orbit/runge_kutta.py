"""Explicit Runge-Kutta method of order eight in eleven stages (Cooper and Verner 1972).

Coefficients in closed form in the square root of 21, with the nodes of Lobatto's quadrature: only five distinct
instants per step, so that functions of time alone are evaluated five times for eleven stages.
"""

from math import sqrt

import numpy as np

_S = sqrt(21.0)

STAGES = 11

INSTANTS = np.array([0.0, 0.5, (7.0 + _S) / 14.0, (7.0 - _S) / 14.0, 1.0])
"""Distinct nodes, in fractions of the step."""

INSTANT_OF_STAGE = np.array([0, 1, 1, 2, 2, 1, 3, 3, 1, 2, 4])
"""Index into `INSTANTS` of every stage."""

WEIGHTS = np.array([1 / 20, 0, 0, 0, 0, 0, 0, 49 / 180, 16 / 45, 49 / 180, 1 / 20])

COUPLING = np.zeros((STAGES, STAGES))
"""Strictly lower triangular: row i has the weights of the earlier derivatives in the argument of stage i."""

COUPLING[1, :1] = [1 / 2]
COUPLING[2, :2] = [1 / 4, 1 / 4]
COUPLING[3, :3] = [1 / 7, (-7 - 3 * _S) / 98, (21 + 5 * _S) / 49]
COUPLING[4, :4] = [(11 + _S) / 84, 0, (18 + 4 * _S) / 63, (21 - _S) / 252]
COUPLING[5, :5] = [(5 + _S) / 48, 0, (9 + _S) / 36, (-231 + 14 * _S) / 360, (63 - 7 * _S) / 80]
COUPLING[6, :6] = [
    (10 - _S) / 42,
    0,
    (-432 + 92 * _S) / 315,
    (633 - 145 * _S) / 90,
    (-504 + 115 * _S) / 70,
    (63 - 13 * _S) / 35,
]
COUPLING[7, :7] = [1 / 14, 0, 0, 0, (14 - 3 * _S) / 126, (13 - 3 * _S) / 63, 1 / 9]
COUPLING[8, :8] = [
    1 / 32,
    0,
    0,
    0,
    (91 - 21 * _S) / 576,
    11 / 72,
    (-385 - 75 * _S) / 1152,
    (63 + 13 * _S) / 128,
]
COUPLING[9, :9] = [
    1 / 14,
    0,
    0,
    0,
    1 / 9,
    (-733 - 147 * _S) / 2205,
    (515 + 111 * _S) / 504,
    (-51 - 11 * _S) / 56,
    (132 + 28 * _S) / 245,
]
COUPLING[10, :10] = [
    0,
    0,
    0,
    0,
    (-42 + 7 * _S) / 18,
    (-18 + 28 * _S) / 45,
    (-273 - 53 * _S) / 72,
    (301 + 53 * _S) / 72,
    (28 - 28 * _S) / 45,
    (49 - 7 * _S) / 18,
]
