"""Orbit Ephemeris Message (CCSDS 502.0-B-3), in its keyword form."""

import re
from datetime import datetime
from pathlib import Path

import numpy as np

from formation_gnc import __version__
from formation_gnc.errors import ConfigurationError, OrbitError
from formation_gnc.interchange.ephemeris import Ephemeris
from formation_gnc.interchange.source import FRAMES, METRES, OrbitSource, to_j2000
from formation_gnc.types import Matrix, Vector
from formation_gnc.units import EPOCH_UNIT, to_si

_SCALES = {"UTC": 0.0, "TT": 0.0, "TDB": 0.0, "TAI": 32.184, "GPS": 51.184}
"""TT minus each time system, s; UTC's is in the date's conversion, and TDB's is below 2 ms."""

NEIGHBOURS = 8
"""States that one in between is interpolated from: a polynomial of degree 15 through positions and velocities."""


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


class EphemerisMessage(OrbitSource):
    """A satellite by a segment of an OEM, interpolated by Hermite's polynomial."""

    def __init__(self, name: str, frame: str, times: Vector, states: Matrix) -> None:
        """Take its states (N, 6), m and m/s, at times (N,), s of TT since J2000.0, ascending."""
        self.name, self._frame = name, frame
        self._times, self._states = times, states
        self.first, self.last = float(times[0]), float(times[-1])
        self.reference = self.first

    def state(self, time: float) -> Vector:
        """As `OrbitSource.state`."""
        from scipy.interpolate import KroghInterpolator

        if not self.first <= time <= self.last:
            raise OrbitError(f"{self.name}: its ephemeris does not reach {time:g} s since J2000.0")
        at = int(np.searchsorted(self._times, time))
        begin = min(max(0, at - NEIGHBOURS // 2), max(0, len(self._times) - NEIGHBOURS))
        near = slice(begin, begin + NEIGHBOURS)
        scale = max(float(np.ptp(self._times[near])), 1.0)
        nodes = np.repeat((self._times[near] - time) / scale, 2)
        values = np.empty((len(nodes), 3))
        values[::2], values[1::2] = self._states[near, :3], self._states[near, 3:] * scale
        position, rate = KroghInterpolator(nodes, values).derivatives(0.0, 2)
        return to_j2000(np.concatenate((position, rate / scale)), self._frame, time)


def read_oem(path: Path, text: str) -> list[OrbitSource]:
    """Every segment of an OEM in keyword form, about the Earth.

    Raises:
        OrbitError: another centre, frame or time system, a line that cannot be read, or times that do not ascend.
    """
    found: list[OrbitSource] = []
    for segment in re.split(r"^META_START\s*$", text, flags=re.MULTILINE)[1:]:
        head, _, body = segment.partition("META_STOP")
        found.append(_segment(path, _metadata(head), body.split("COVARIANCE_START")[0]))
    if not found:
        raise OrbitError(f"{path}: has no segment of an OEM")
    return found


def _metadata(head: str) -> dict[str, str]:
    pairs = (line.split("=", 1) for line in head.splitlines() if "=" in line)
    return {key.strip(): value.strip() for key, value in pairs}


def _segment(path: Path, metadata: dict[str, str], body: str) -> EphemerisMessage:
    name = metadata.get("OBJECT_NAME", path.stem)
    frame = re.sub(r"^ITRF[-0-9]*$", "ITRF", metadata.get("REF_FRAME", ""))
    allowed = {"CENTER_NAME": {"EARTH"}, "TIME_SYSTEM": set(_SCALES), "REF_FRAME": set(FRAMES)}
    for key, known in allowed.items():
        value = frame if key == "REF_FRAME" else metadata.get(key, "").upper()
        if value not in known:
            raise OrbitError(
                f"{path}: {name}: {key} {value or 'none'}: is not allowed; it must be {', '.join(sorted(known))}"
            )
    times, states = [], []
    for line in body.splitlines():
        date, *values = line.split() or ["COMMENT"]
        if date == "COMMENT":
            continue
        try:
            times.append(_time(date, metadata["TIME_SYSTEM"].upper()))
            states.append([float(value) for value in values[:6]])
            if len(states[-1]) != 6 or not np.isfinite(states[-1]).all():
                raise ValueError("it must have six finite numbers")
        except ValueError as error:
            raise OrbitError(f"{path}: {name}: {line.strip()!r}: {error}") from None
    if len(times) < 2 or (np.diff(times) <= 0.0).any():
        raise OrbitError(f"{path}: {name}: its times must ascend, and be two or more")
    return EphemerisMessage(name, FRAMES[frame], np.array(times), np.array(states) * METRES)


def _time(date: str, system: str) -> float:
    """s of TT since J2000.0 of a date, of month or of year, in a time system; raises ValueError for none."""
    if re.match(r"\d{4}-\d{3}T", date):
        date = f"{datetime.strptime(date[:8], '%Y-%j'):%Y-%m-%d}{date[8:]}"
    if system != "UTC":
        since = np.datetime64(date.rstrip("Z"), "ns") - np.datetime64("2000-01-01T12:00:00", "ns")
        return float(since / np.timedelta64(1, "ns")) * 1e-9 + _SCALES[system]
    seconds = to_si(date[:26], EPOCH_UNIT)  # to the microsecond
    if seconds is None:
        raise ConfigurationError(f"{date!r} is no date")
    return seconds
