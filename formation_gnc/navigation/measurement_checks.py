"""Checks of a measurement before the filter uses it; rejections are counted by reason."""

from collections import Counter
from collections.abc import Iterable
from math import isfinite, sqrt

import numpy as np

from formation_gnc.navigation.measurement import Readings, measurement_model
from formation_gnc.navigation.state_history import StateHistory
from formation_gnc.orbit.constants import EARTH_RADIUS
from formation_gnc.records import Measurement, Reading, Rejection, RejectionCount
from formation_gnc.sensors.registry import sensors
from formation_gnc.types import NANOSECONDS, Vector

FORGET_EVERY = 64
"""Readings of a sensor after which remembered times are dropped that are too old to repeat."""

LARGEST_RADIUS, LARGEST_SPEED = 1e9, 1.2e4
"""Beyond any orbit about the Earth, m and m/s."""

LEAST_SPEED_ACROSS = 1.0
"""Below any orbit that stays above the ground, m/s: a chief has a Hill frame and a period by it."""

LARGEST_ACCELERATION = 100.0
"""Beyond any thruster, m/s^2."""

LEAST_MASS = 1e-6
"""Below any satellite, kg."""

MASS_STEP = 0.1
"""Beyond what any thruster uses between two measurements, over the mass."""


class Rejections:
    """Counts of rejections since the start of the run, and reports of them for events."""

    def __init__(self) -> None:
        """Without a rejection."""
        self.counts: list[RejectionCount] = []
        """By reason, in the order in which they came up; replaced at every rejection, since estimates hold it."""
        self._by_reason: Counter[Rejection] = Counter()
        self._by_subject: Counter[tuple[str, Rejection]] = Counter()
        self._reports: list[tuple[str, str]] = []

    def add(self, reason: Rejection, subject: str, detail: str = "") -> None:
        """Count a rejection of a subject, such as a sensor; the 1st, 10th, 100th, ... of a kind is reported."""
        self._by_reason[reason] += 1
        self.counts = [RejectionCount(str(each), count) for each, count in self._by_reason.items()]
        self._by_subject[subject, reason] += 1
        count = self._by_subject[subject, reason]
        if str(count).strip("0") == "1":
            words = reason.replace("_", " ")
            text = f"{words}, {detail}" if detail else words
            self._reports.append((subject, text if count == 1 else f"{text} ({count} by now)"))

    def take_reports(self) -> list[tuple[str, str]]:
        """Subject and detail of each report since they were last taken."""
        reports, self._reports = self._reports, []
        return reports


class ReadingChecks:
    """Checks each reading by itself, before it is compared with the state."""

    def __init__(self, rejections: Rejections) -> None:
        """Without a memory of readings."""
        self._rejections = rejections
        self._times: dict[str, set[int]] = {}
        self._read: dict[str, int] = {}
        self._silent: set[str] = set()
        self._next_silence = 0

    def accept(
        self,
        readings: list[Reading],
        time: int,
        variance: dict[str, tuple[float, ...]],
        latest: float,
        chief: Vector,
        history: StateHistory,
    ) -> Readings | None:
        """Valid readings; none when there are none.

        Args:
            readings: of a measurement.
            time: its stamp, ns.
            variance: of the noise of each value, by sensor in use; other sensors' readings are ignored.
            latest: age (s) above which a reading is rejected.
            chief: inertial state now, (6,).
            history: past intervals.
        """
        names: list[str] = []
        values: list[float] = []
        ages: list[float] = []
        variances: list[float] = []
        for reading in readings:
            noise = variance.get(reading.sensor)
            if noise is None:
                if reading.sensor not in sensors():
                    self._rejections.add(Rejection.UNKNOWN_SENSOR, reading.sensor)
                continue
            reason = self._fault(reading, len(noise), time, latest)
            if reason is not None:
                self._rejections.add(reason, reading.sensor)
                continue
            self._read[reading.sensor] = time
            names.append(reading.sensor)
            values += reading.values
            ages.append(reading.age / NANOSECONDS)
            variances += noise
        if not names:
            return None
        model = measurement_model(tuple(names))
        return Readings(model, np.array(values), ages, np.array(variances), chief, history, any(ages))

    def take_silences(self, sensors_in_use: Iterable[str], start: int, time: int, after: int) -> list[tuple[str, str]]:
        """Subject and detail for each sensor in use that has given no valid reading for long, and when it reads again.

        Args:
            sensors_in_use: their names.
            start: when readings could begin, ns.
            time: now, ns.
            after: ns without a valid reading that are reported.
        """
        if time < self._next_silence:
            return []
        reports, self._next_silence = [], time + after // 10
        for name in sensors_in_use:
            last = self._read.get(name)
            is_silent = time - (start if last is None else last) >= after
            if is_silent == (name in self._silent):
                continue
            self._silent ^= {name}
            if not is_silent:
                reports.append((name, "reads again"))
            elif last is None:
                reports.append((name, f"in use, but it has never read in {after / NANOSECONDS:g} s"))
            else:
                reports.append((name, f"in use, but no valid reading for {after / NANOSECONDS:g} s"))
        return reports

    def _fault(self, reading: Reading, size: int, time: int, latest: float) -> Rejection | None:
        if len(reading.values) != size or not all(map(isfinite, reading.values)):
            return Rejection.NOT_FINITE
        if reading.age < 0:
            return Rejection.FUTURE
        if reading.age / NANOSECONDS > latest:
            return Rejection.LATE
        taken = time - reading.age
        known = self._times.setdefault(reading.sensor, set())
        if taken in known:
            return Rejection.DUPLICATE
        if len(known) % FORGET_EVERY == 0:
            oldest = time - round(latest * NANOSECONDS)
            known.difference_update([each for each in known if each < oldest])
        known.add(taken)
        return None


def has_plausible_fix(measurement: Measurement) -> bool:
    """Whether a measurement brings an acquisition fix that can be in an orbit, about a chief that is."""
    return (
        measurement.fix_available
        and is_plausible_chief(measurement.chief_state)
        and is_plausible_fix(measurement.fix, measurement.chief_state)
    )


def is_plausible_fix(fix: Vector, chief: Vector) -> bool:
    """Whether an acquisition fix (6,) about a chief (6,) can be in an orbit, outside the Earth."""
    x, y, z, vx, vy, vz = fix.tolist()
    radial = x + sqrt(chief[:3] @ chief[:3])
    above = EARTH_RADIUS**2 < radial * radial + y * y + z * z < LARGEST_RADIUS**2
    return bool(above and vx * vx + vy * vy + vz * vz < LARGEST_SPEED**2)


def is_plausible_chief(chief: Vector) -> bool:
    """Whether an inertial state (6,) can be an orbit: finite, above the ground, not rectilinear, bound."""
    x, y, z, vx, vy, vz = map(float, chief)
    if not all(map(isfinite, (x, y, z, vx, vy, vz))):
        return False
    square, speed = x * x + y * y + z * z, vx * vx + vy * vy + vz * vz
    radial = x * vx + y * vy + z * vz
    across = square * speed - radial * radial > square * LEAST_SPEED_ACROSS**2
    return EARTH_RADIUS**2 < square < LARGEST_RADIUS**2 and across and speed < LARGEST_SPEED**2


def is_plausible_mass(mass: float, before: float | None = None) -> bool:
    """Whether a mass (kg) can be a satellite's, after the one before."""
    return isfinite(mass) and mass > LEAST_MASS and (before is None or abs(mass - before) <= MASS_STEP * before)


def is_plausible_acceleration(x: float, y: float, z: float) -> bool:
    """Whether an acceleration (m/s^2, by axis) can be a thruster's."""
    return x * x + y * y + z * z <= LARGEST_ACCELERATION**2  # false for NaN
