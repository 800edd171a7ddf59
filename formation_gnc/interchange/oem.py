"""Orbit Ephemeris Message (CCSDS 502.0-B-3), in its keyword form."""

from pathlib import Path

import numpy as np

from formation_gnc import __version__
from formation_gnc.interchange.ephemeris import Ephemeris


def write_oem(ephemeris: Ephemeris, path: Path) -> None:
    """Write a satellite's states: EME2000, Terrestrial Time, km and km/s, every bit of a number.

    The creation date is the run's own start, so that the same run gives the same file.
    """
    dates = np.datetime_as_string(ephemeris.dates(), unit="ns")
    lines = [
        "CCSDS_OEM_VERS = 2.0",
        f"COMMENT Written by formation_gnc {__version__}; CREATION_DATE is the start of the run",
        f"CREATION_DATE = {dates[0]}",
        "ORIGINATOR = FORMATION_GNC",
        "",
        "META_START",
        f"OBJECT_NAME = {ephemeris.name}",
        f"OBJECT_ID = {ephemeris.name}",
        "CENTER_NAME = EARTH",
        "REF_FRAME = EME2000",
        "TIME_SYSTEM = TT",
        f"START_TIME = {dates[0]}",
        f"STOP_TIME = {dates[-1]}",
        "INTERPOLATION = HERMITE",
        "INTERPOLATION_DEGREE = 7",
        "META_STOP",
        "",
    ]
    rows = zip(dates.tolist(), (ephemeris.states * 1e-3).tolist(), strict=True)
    lines += [f"{date} {' '.join(map(repr, state))}" for date, state in rows]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
