"""Euclidean norm for measurement functions."""

from collections.abc import Callable
from math import hypot, sqrt
from typing import Any

from numba.extending import overload


def norm(x: float, y: float, z: float = 0.0) -> float:
    """Euclidean norm: rounded correctly in Python, the plain root of the sum of squares in kernels.

    The two may differ in the last bit.
    """
    return hypot(x, y, z)


@overload(norm, strict=False)  # type: ignore[untyped-decorator]  # strict: with the same annotations
def _norm(x: Any, y: Any, z: Any = 0.0) -> Callable[..., float]:
    return lambda x, y, z=0.0: sqrt(x * x + y * y + z * z)
