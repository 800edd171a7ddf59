"""Two-line element sets, propagated by SGP4 as Skyfield has it, which also turns TEME to inertial axes."""

from pathlib import Path

import numpy as np

from formation_gnc.errors import OrbitError
from formation_gnc.interchange.source import METRES, OrbitSource, to_j2000
from formation_gnc.interchange.times import instant, timescale
from formation_gnc.types import Vector

DAY = 86400.0

MOST_DAYS = 30.0
"""Days from its epoch for which an element set is used; its error grows by a kilometre or so a day."""


class TwoLineElements(OrbitSource):
    """A satellite by its element set: SGP4, and TEME turned to the axes of J2000."""

    def __init__(self, name: str, one: str, two: str) -> None:
        """Read the lines; raises ValueError for what is no element set."""
        from sgp4.io import verify_checksum
        from skyfield.api import EarthSatellite  # takes long to import

        verify_checksum(one, two)
        self._satellite = EarthSatellite(one, two, name, timescale())
        self.name = name or f"satellite {self._satellite.model.satnum}"
        epoch = self._satellite.epoch
        self.reference = float((epoch.whole - 2451545.0 + epoch.tt_fraction) * DAY)
        self.first, self.last = (self.reference + sign * MOST_DAYS * DAY for sign in (-1.0, 1.0))

    def state(self, time: float) -> Vector:
        """As `OrbitSource.state`."""
        if not self.first <= time <= self.last:
            away = abs(time - self.reference) / DAY
            raise OrbitError(
                f"{self.name}: {away:.1f} days from the epoch of its TLE; at most {MOST_DAYS:g} are allowed"
            )
        seen = self._satellite.at(instant(time))
        if seen.message:
            raise OrbitError(f"{self.name}: SGP4: {seen.message}")
        return to_j2000(np.concatenate((seen.position.m, seen.velocity.km_per_s * METRES)), "GCRF", time)


def read_tle(path: Path, text: str) -> list[OrbitSource]:
    """Every satellite of a file of element sets, with or without a line of its name.

    Raises:
        OrbitError: a line that belongs to no set, or a set that cannot be read; with its line.
    """
    found: list[OrbitSource] = []
    lines = [(number, line.rstrip()) for number, line in enumerate(text.splitlines(), 1) if line.strip()]
    name, first = "", ""
    for number, line in lines:
        if line.startswith("1 ") and not first:
            first = line
        elif line.startswith("2 ") and first:
            try:
                found.append(TwoLineElements(name, first, line))
            except ValueError as error:
                raise OrbitError(f"{path}: line {number}: {' '.join(str(error).split())}") from None
            name = first = ""
        elif not first:
            name = line.removeprefix("0 ").strip()
        else:
            raise OrbitError(f"{path}: line {number}: {line[:24]!r} is no second line of a TLE; it must begin with 2")
    if first or not found:
        raise OrbitError(f"{path}: {'the last TLE has one line' if first else 'has no TLE'}; a set has two")
    return found
