"""What comes in is checked here before the filter sees it, and what is rejected is counted by reason."""

from math import isfinite

import numpy as np

from formation_gnc.navigation.measurement import NAMES, Readings, StateHistory
from formation_gnc.orbit.constants import EARTH_RADIUS
from formation_gnc.records import Measurement, Reading, Rejection, RejectionCount
from formation_gnc.types import NANOSECONDS, Vector

WORDS = {reason: reason.replace("_", " ") for reason in Rejection}

MEMORY = 20
"""Times of readings of a sensor above which those are forgotten that are too old to come again."""

FARTHEST, FASTEST = 1e9, 1.2e4
"""Beyond what orbits about the Earth reach: distance from its centre, m, and speed, m/s."""

_SENSORS = {name: int(sensor) for sensor, name in NAMES.items()}


class Rejections:
    """Counts of what was rejected since the start of the run, and the news of them."""

    def __init__(self) -> None:
        """Nothing yet."""
        self.counts: list[RejectionCount] = []
        self._seen: dict[tuple[str, Rejection], int] = {}
        self._news: list[tuple[str, str]] = []

    def add(self, reason: Rejection, what: str, detail: str = "") -> None:
        """Count a rejection of something, such as a sensor's reading; the 1st, 10th, 100th ... of a kind is
        news."""
        counts = {each.reason: each.count for each in self.counts}
        counts[reason] = counts.get(reason, 0) + 1
        self.counts = [RejectionCount(*each) for each in counts.items()]  # an estimate holds the old ones
        self._seen[what, reason] = seen = self._seen.get((what, reason), 0) + 1
        if str(seen).strip("0") == "1":
            text = f"{WORDS[reason]}, {detail}" if detail else WORDS[reason]
            self._news.append((what, text if seen == 1 else f"{text} ({seen} by now)"))

    def news(self) -> list[tuple[str, str]]:
        """Subject and detail of what there is to log since it was last asked for."""
        news, self._news = self._news, []
        return news


class Screen:
    """Checks readings, each for itself, before any of them is compared with the state."""

    def __init__(self, rejections: Rejections) -> None:
        """Remember no reading yet."""
        self._rejections = rejections
        self._taken: dict[str, list[int]] = {}

    def admit(
        self,
        measurement: Measurement,
        variance: dict[int, float],
        latest: float,
        chief: Vector,
        track: StateHistory,
    ) -> Readings | None:
        """The readings that are what they should be; none when there are none.

        Args:
            measurement: with readings.
            variance: by sensor in use; readings of others are left out.
            latest: age (s) above which a reading is rejected.
            chief: inertial state now, (6,).
            track: the legs that led here.
        """
        sensors: list[int] = []
        values: list[float] = []
        ages: list[float] = []
        for reading in measurement.readings:
            sensor = _SENSORS.get(reading.sensor)
            if sensor is None:
                self._rejections.add(Rejection.UNKNOWN_SENSOR, reading.sensor)
            elif sensor in variance:
                reason = self._fault(measurement.time, reading, latest)
                if reason is None:
                    sensors.append(sensor)
                    values.append(reading.values[0])
                    ages.append(reading.age / NANOSECONDS)
                else:
                    self._rejections.add(reason, reading.sensor)
        if not sensors:
            return None
        return Readings(
            np.array(sensors, dtype=np.int64),
            np.array(values),
            np.array(ages),
            np.array([variance[sensor] for sensor in sensors]),
            chief,
            track,
            any(ages),
        )

    def _fault(self, time: int, reading: Reading, latest: float) -> Rejection | None:
        if len(reading.values) != 1 or not isfinite(reading.values[0]):
            return Rejection.NOT_FINITE
        if reading.age < 0:
            return Rejection.FUTURE
        if reading.age / NANOSECONDS > latest:
            return Rejection.LATE
        taken = time - reading.age
        known = self._taken.setdefault(reading.sensor, [])
        if taken in known:
            return Rejection.DUPLICATE
        if len(known) > MEMORY:
            oldest = time - round(latest * NANOSECONDS)
            known[:] = [each for each in known if each >= oldest]
        known.append(taken)
        return None


def credible_fix(fix: Vector, chief: Vector) -> bool:
    """Whether an acquisition fix (6,) can be one: in an orbit, not inside the Earth."""
    x, y, z, vx, vy, vz = fix.tolist()
    height = x + float(np.sqrt(chief[:3] @ chief[:3]))
    above = EARTH_RADIUS**2 < height * height + y * y + z * z < FARTHEST**2
    return bool(above and vx * vx + vy * vy + vz * vz < FASTEST**2)


def credible_chief(chief: Vector) -> bool:
    """Whether an inertial state (6,) can be an orbit: finite, above the ground, moving across the radius,
    and bound."""
    x, y, z, vx, vy, vz = map(float, chief)
    if not all(map(isfinite, (x, y, z, vx, vy, vz))):
        return False
    square, speed = x * x + y * y + z * z, vx * vx + vy * vy + vz * vz
    radial = x * vx + y * vy + z * vz
    across = square * speed - radial * radial
    return EARTH_RADIUS**2 < square < FARTHEST**2 and across > 1.0 and speed < FASTEST**2
