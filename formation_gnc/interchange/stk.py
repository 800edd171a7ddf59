"""Ephemeris file of STK (.e), version 12."""

from pathlib import Path

import numpy as np

from formation_gnc.interchange.ephemeris import Ephemeris
from formation_gnc.interchange.times import utc


def write_stk(ephemeris: Ephemeris, path: Path) -> None:
    """Write a satellite's states: J2000 axes about the Earth, m and m/s, seconds since the start in UTC."""
    start = utc(ephemeris.epoch + float(ephemeris.times[0]))
    lines = [
        "stk.v.12.0",
        "",
        "BEGIN Ephemeris",
        f"NumberOfEphemerisPoints {len(ephemeris.times)}",
        f"ScenarioEpoch {start:%d %b %Y %H:%M:%S.%f}",
        "InterpolationMethod Hermite",
        "InterpolationOrder 7",
        "CentralBody Earth",
        "CoordinateSystem J2000",
        "DistanceUnit Meters",
        "",
        "EphemerisTimePosVel",
        "",
    ]
    table = np.column_stack((ephemeris.times - ephemeris.times[0], ephemeris.states))
    lines += [" ".join(map(repr, row)) for row in table.tolist()]
    path.write_text("\n".join([*lines, "", "END Ephemeris"]) + "\n", encoding="utf-8")
