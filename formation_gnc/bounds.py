"""Bounds on the values of records that come from elsewhere: finite, within a range, no longer than makes sense.

A record's fields carry them as metadata; whoever decodes a message checks them once, so that modules need not.
"""

import dataclasses
from collections.abc import Callable, Iterable, Sized
from functools import cache
from math import hypot, isfinite
from typing import Any

import numpy as np

from formation_gnc.errors import ConfigurationError
from formation_gnc.types import Matrix, Vector

type Bound = Callable[[Any], str]
"""What a value must be, in words; empty for one that is."""

LARGEST = 1e12
"""Beyond any state in orbit about the Earth, m or m/s."""

LARGEST_RADIUS, LEAST_RADIUS, LEAST_SPEED_ACROSS = 1e10, 1e5, 1.0
"""Orbits whose period and frame exist without overflow: m, m, m/s."""


def bounded(bound: Bound, **metadata: Any) -> dict[str, Any]:
    """Metadata of a field with a bound."""
    return metadata | {"bound": bound}


def finite_state(value: Vector | Matrix) -> str:
    """States or lists of them, of any shape."""
    # No warning of an overflow, as NumPy's: a context against it is slow to enter. False for NaN.
    return "" if hypot(*value.ravel().tolist()) < LARGEST else f"finite and below {LARGEST:g}"


def orbit(state: Vector) -> str:
    """An inertial state (6,) that has an orbit: finite, off the centre, not rectilinear."""
    x, y, z, vx, vy, vz = state.tolist()
    square = x * x + y * y + z * z
    along = x * vx + y * vy + z * vz
    speed = vx * vx + vy * vy + vz * vz
    if LEAST_RADIUS**2 < square < LARGEST_RADIUS**2 and speed < LARGEST:
        across = speed - along * along / square
        if across > LEAST_SPEED_ACROSS**2:
            return ""
    return f"an orbit ({LEAST_RADIUS:g} to {LARGEST_RADIUS:g} m, at least {LEAST_SPEED_ACROSS:g} m/s across)"


def within(least: float, greatest: float) -> Bound:
    """A number between two, both allowed."""

    def check(value: float) -> str:
        return "" if isfinite(value) and least <= value <= greatest else f"between {least:g} and {greatest:g}"

    return check


def at_most(count: int, element: Bound | None = None) -> Bound:
    """A text, list or array of so many elements; `element` bounds it as a whole."""

    def check(value: Sized) -> str:
        if len(value) > count:
            return f"at most {count} long"
        return element(value) if element else ""

    return check


def among(names: Iterable[str]) -> Bound:
    """One of some texts."""
    allowed = frozenset(map(str, names))
    words = f"one of {', '.join(sorted(allowed))}"
    return lambda value: "" if value in allowed else words


def each(count: int) -> Bound:
    """A list of at most so many records, each within its own bounds."""

    def check(value: list[Any]) -> str:
        if len(value) > count:
            return f"at most {count} long"
        return next((f"a list in which {reason}" for reason in map(violation, value) if reason), "")

    return check


def violation(record: Any) -> str:
    """The first value of a record that is out of its bounds and what it must be, in words; empty for none."""
    for name, bound in _bounds(record.__class__):
        value = getattr(record, name)
        allowed = bound(value)
        if allowed:
            return f"{name} must be {allowed}, not {_words(value)}"
    return ""


def _words(value: Any) -> str:
    if isinstance(value, str):
        return repr(value) if len(value) <= 60 else f"{len(value)} characters"
    if isinstance(value, Sized) and len(value) > 6:
        return f"{len(value)} values"
    return np.array2string(np.asarray(value), max_line_width=200)


def checked[T](record: T) -> T:
    """The record; raises ConfigurationError for a value that is out of its bounds."""
    reason = violation(record)
    if reason:
        raise ConfigurationError(f"message {type(record).message}: {reason}")  # type: ignore[attr-defined]
    return record


@cache
def _bounds(record_type: Any) -> tuple[tuple[str, Bound], ...]:
    fields = dataclasses.fields(record_type)
    return tuple((field.name, field.metadata["bound"]) for field in fields if "bound" in field.metadata)


def has_bounds(record_type: type) -> bool:
    """Whether any field of a record has a bound."""
    return bool(_bounds(record_type))
