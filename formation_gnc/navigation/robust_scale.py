"""Scale of white noise among outliers, and above what varies slowly."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.special import chdtr, chdtri

from formation_gnc.types import Matrix

SHARE = 0.25
"""Quantile of the magnitudes that the scale starts from: three quarters may be outliers to the upper side."""

CLIP = 3.0
"""Standard deviations, by probability, beyond which a value is left out of the variance."""

PASSES = 3

ALIKE = 0.25
"""Share of the white part in the mean square, below which values are called alike: a correlation of 3/4."""


@dataclass(frozen=True, slots=True)
class WhiteNoise:
    """Noise found in a series of values."""

    variance: float
    """Half the mean squared successive difference: what varies slowly cancels (von Neumann 1941)."""
    mean_square: float
    kept: tuple[int, ...]
    """Places of the values that are no outliers."""

    @property
    def is_white(self) -> bool:
        """Whether successive values differ as much as they spread."""
        return self.variance > ALIKE * self.mean_square


def white_noise(values: Matrix) -> WhiteNoise:
    """Variance of the white part of a series (n, k) of k values each, by clipping from a low quantile on.

    The quantile of the magnitudes bounds those of the well-behaved values from above however far outliers are; each
    pass keeps what is within `CLIP` standard deviations, and takes the mean square of that (Huber 1981, ch. 5).
    """
    size = values.shape[1]
    squares = np.einsum("ij,ij->i", values, values)
    quantile, clip, kept_variance = _constants(size)
    low = int(SHARE * (len(squares) - 1))
    scale = float(np.partition(squares, low)[low]) / quantile
    for _ in range(PASSES):
        kept = np.flatnonzero(squares <= clip * scale)
        scale = float(squares[kept].mean()) / size / kept_variance
    differences = np.diff(values[kept], axis=0)
    variance = float(np.mean(differences**2)) / 2.0 / kept_variance if len(kept) > 1 else 0.0
    return WhiteNoise(variance, scale, tuple(kept))


@cache
def _constants(size: int) -> tuple[float, float, float]:
    """Of the squared magnitude of `size` unit normal values: quantile, clip, and variance left within the clip."""
    inside = float(chdtr(1, CLIP**2))
    clip = float(chdtri(size, 1.0 - inside))
    return float(chdtri(size, 1.0 - SHARE)), clip, float(chdtr(size + 2, clip)) / inside
