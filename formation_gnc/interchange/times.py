"""Dates in UTC of instants in Terrestrial Time."""

from datetime import datetime


def utc(seconds: float) -> datetime:
    """UTC, to the microsecond, of a time in s of TT since J2000.0; leap seconds as Skyfield's table has them."""
    from skyfield.api import load  # takes long to import

    day, second = divmod(seconds, 86400.0)
    date = load.timescale(builtin=True).tt_jd(2451545.0 + day, second / 86400.0).utc_datetime()
    return date if isinstance(date, datetime) else datetime.fromisoformat(str(date))
