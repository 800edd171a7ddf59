"""Arrays and time as the whole package writes them."""

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Times = NDArray[np.int64]

AXES = ("x", "y", "z")
"""Names of the Hill axes."""

NANOSECONDS = 1_000_000_000
"""Nanoseconds in a second: stamps and durations are whole nanoseconds of simulated time."""
