"""Positions of Sun and Moon from elsewhere, such as JPL's DE421, as tables for the compiled forces."""

from collections.abc import Callable, Sequence
from functools import cache
from math import floor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from formation_gnc.errors import ConfigurationError
from formation_gnc.orbit.sky import NO_TABLE, SEGMENT, moon, sun

Array = NDArray[np.float64]

Place = Callable[[float], Sequence[float] | Array]
"""Geocentric position (3,), m, J2000, at a time, s of Terrestrial Time since J2000.0. It must be smooth over days."""

EPHEMERIDES = ("series", "de421")

TERMS = 14
"""Terms of the Chebyshev polynomial over a segment of two days: DE421 within a millimetre for the Moon, and for the Sun
within 2 cm, its rounding."""

_NODES = np.cos(np.pi * (np.arange(TERMS) + 0.5) / TERMS)
_TO_COEFFICIENTS = 2.0 / TERMS * np.cos(np.outer(np.arange(TERMS), np.pi * (np.arange(TERMS) + 0.5) / TERMS))
_TO_COEFFICIENTS[0] *= 0.5


class Ephemerides:
    """Sun and Moon as polynomials over segments that do not depend on when a run begins."""

    def __init__(self, sun_at: Place, moon_at: Place) -> None:
        """Take positions from functions."""
        self._places = (sun_at, moon_at)
        self.is_series = sun_at is sun and moon_at is moon
        """Whether both are the compiled series, without a table."""
        self._table = (NO_TABLE, 0)

    def table(self, begin: float, end: float) -> tuple[Array, int]:
        """Table for `formation_gnc.orbit.sky.look_up` that covers a span of time, and the number of its first segment.

        Args:
            begin: s of Terrestrial Time since J2000.0.
            end: likewise.

        Returns:
            (segments, 6, TERMS); empty for the series, which are compiled themselves.

        Raises:
            ConfigurationError: a time that the ephemerides do not cover.
        """
        if not self.is_series:
            first, last = floor(begin / SEGMENT), floor(end / SEGMENT)
            table, start = self._table
            if first < start or last >= start + len(table):
                self._table = (np.array([self._segment(each) for each in range(first, last + 1)]), first)
        return self._table

    def _segment(self, number: int) -> Array:
        """Chebyshev coefficients of a segment, (6, TERMS)."""
        times = (number + 0.5 * (_NODES + 1.0)) * SEGMENT
        values = np.array([np.concatenate([place(time) for place in self._places]) for time in times])
        coefficients: Array = (_TO_COEFFICIENTS @ values).T
        return coefficients


_DE421 = (-36680.0 * 86400.0, 19639.0 * 86400.0)
"""Span of the file, s since J2000.0: 29 July 1899 to 9 October 2053."""


@cache
def de421() -> tuple[Place, Place]:
    """Sun and Moon of JPL's DE421, geometric, 1899 to 2053, by skyfield from the file of skyfield-data.

    Raises:
        ConfigurationError: skyfield or skyfield-data is not installed.
    """
    try:
        import skyfield_data
        from skyfield.api import load
        from skyfield.jpllib import SpiceKernel
    except ImportError:
        raise ConfigurationError(
            "skyfield or skyfield-data is not installed: pip install skyfield skyfield-data"
        ) from None
    scale = load.timescale(builtin=True)
    kernel = SpiceKernel(Path(skyfield_data.__file__).parent / "data" / "de421.bsp")

    def place(body: str) -> Place:
        path = kernel[body] - kernel["earth"]

        def at(time: float) -> Array:
            if not _DE421[0] < time < _DE421[1]:
                raise ConfigurationError(
                    f"time {time:.9g} s since J2000.0 is outside of DE421: it must be in the years 1900 to 2052"
                )
            position: Array = path.at(scale.tt_jd(2451545.0, time / 86400.0)).position.m
            return position

        return at

    return place("sun"), place("moon")
