"""Values with a unit beside the number, as `97.4 deg` or `700 km`: the one place where text becomes SI."""

import re
from datetime import UTC, datetime
from math import pi

from formation_gnc.errors import ConfigurationError

EPOCH_UNIT = "s since J2000.0"
"""Unit of an instant, which a date stands for as well."""

_FACTORS: dict[str, dict[str, float]] = {
    "m": {"m": 1.0, "km": 1e3, "cm": 1e-2, "mm": 1e-3},
    "m/s": {"m/s": 1.0, "km/s": 1e3, "cm/s": 1e-2, "mm/s": 1e-3},
    "s": {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0, "d": 86400.0},
    "rad": {"rad": 1.0, "deg": pi / 180.0, "mrad": 1e-3, "arcmin": pi / 10800.0, "arcsec": pi / 648000.0},
    "rad/s": {"rad/s": 1.0, "deg/s": pi / 180.0},
    "kg": {"kg": 1.0, "g": 1e-3},
    "N": {"N": 1.0, "kN": 1e3, "mN": 1e-3, "uN": 1e-6},
    "N s": {"N s": 1.0, "mN s": 1e-3},
    "m^2": {"m^2": 1.0, "cm^2": 1e-4},
}
"""Units by the SI unit that they are converted to."""

_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s+(\S.*?)\s*")


def to_si(text: str, unit: str) -> float | None:
    """Value in an SI unit of a text such as `97.4 deg`, or of a date; None for a text that is neither.

    Raises:
        ConfigurationError: a number with a unit that does not convert to this one, or a date that there is not.
    """
    if unit == EPOCH_UNIT:
        return _since_j2000(text)
    found = _QUANTITY.fullmatch(text)
    if found is None:
        return None
    number, given = found.groups()
    factors = _FACTORS.get(unit, {})
    if given not in factors:
        known = ", ".join(factors) or "a number alone"
        raise ConfigurationError(f"unit {given!r} is not allowed; it must be {known}")
    return float(number) * factors[given]


def _since_j2000(text: str) -> float | None:
    """Terrestrial Time since J2000.0, s, of a date in UTC, as ISO 8601 has it."""
    if not re.match(r"\d{4}-", text):
        return None
    try:
        date = datetime.fromisoformat(text)
    except ValueError as error:
        raise ConfigurationError(f"{error}; it must be like 2026-11-28T12:00:00Z") from None
    from skyfield.api import load  # knows the leap seconds; takes long to import

    date = date.replace(tzinfo=UTC) if date.tzinfo is None else date.astimezone(UTC)
    time = load.timescale(builtin=True).from_datetime(date)
    whole, fraction = time.whole - 2451545.0, time.tt_fraction
    return float(round((whole + fraction) * 86400.0, 6))
