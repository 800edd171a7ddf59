"""Instants in Terrestrial Time as Skyfield has them, with its table of leap seconds."""

from datetime import datetime
from functools import cache
from typing import Any


@cache
def timescale() -> Any:
    """Skyfield's timescale."""
    from skyfield.api import load  # takes long to import

    return load.timescale(builtin=True)


def instant(time: float) -> Any:
    """Skyfield's time of s of TT since J2000.0."""
    day, second = divmod(time, 86400.0)
    return timescale().tt_jd(2451545.0 + day, second / 86400.0)


def utc(time: float) -> datetime:
    """UTC, to the microsecond, of s of TT since J2000.0."""
    date = instant(time).utc_datetime()
    return date if isinstance(date, datetime) else datetime.fromisoformat(str(date))
