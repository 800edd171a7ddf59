"""Noise of each sensor, adapted to what its innovations show.

White innovations that are too large are a sensor's noise; innovations that are too large and alike from one to the
next are an error of the state, which is left to the checks of consistency. Half the mean squared difference of
successive innovations is the variance of the white part alone (von Neumann 1941).
"""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache
from math import sqrt

import numpy as np
from scipy.special import chdtri

from formation_gnc.navigation.kernels.contributions import update_contributions
from formation_gnc.navigation.kernels.linear_algebra import accumulate_transition, restore_definiteness
from formation_gnc.navigation.measurement import Readings
from formation_gnc.navigation.robust_scale import ALIKE, WhiteNoise, white_noise
from formation_gnc.types import Matrix, Vector

JUDGED = 20
"""Innovations of each sensor that a NIS which is too large is judged by."""

WINDOW = 60
"""Innovations over which a sensor's noise is averaged: a standard error of a ninth, of sigma."""

LEAST = 12
"""Innovations before anything is concluded."""

FALSE_ALARM = 1e-6
"""Probability that the window of a sensor as noisy as its parameter says counts as noisier."""

SUSPICION = 1e-3
"""The same once the NIS of all sensors is too large, so that there is something to explain."""

MEMORY = 1.0 - 1.0 / WINDOW
"""Factor, at each reading, on what a sensor's older readings contribute to the covariance that is corrected."""

GROWTH = 1.2
"""Growth of the factor beyond which the readings so far have been weighted too much."""

RETURN = 1.2
"""Variance, over what the parameter predicts, below which a noisier sensor counts as well again."""

REPORTED_AGAIN = 2.0
"""Change of the standard deviation, as a factor, after which it is reported again."""

_IDENTITY = np.eye(6)

_LARGEST = 1e9
"""Innovations are cut to so many standard deviations, whose squares are finite."""


@dataclass(slots=True)
class _SensorNoise:
    """Windows of a sensor."""

    place: int
    """In the order in which sensors came up."""
    factor: float = 1.0
    """Estimated variance of the noise, over that of the parameter; one or more."""
    last: list[float] = field(default_factory=list)
    terms: deque[tuple[float, float, float]] = field(default_factory=deque)
    """Of readings within the gate, over the variance of the noise: half the squared difference, predicted variance and
    square."""
    white: float = 0.0
    """Sum of half the squared differences."""
    state: float = 0.0
    """Sum of the variances of the expected readings."""
    recent: deque[tuple[list[float], float]] = field(default_factory=lambda: deque(maxlen=WINDOW))
    """Of all readings, over what the parameter says: innovations, and the variance of what was expected."""
    reported: float = 1.0
    believed: float = 1.0
    """Factor that the covariance reckons with."""

    def add(self, values: list[float], variance: float, state: float) -> None:
        """Add a reading's innovations within the gate, with the mean variance of noise and of expected values."""
        last, self.last = self.last, values
        if len(last) != len(values):
            return
        unit = variance * len(values)
        white = sum((new - old) ** 2 for new, old in zip(values, last, strict=True)) / (2.0 * unit)
        terms = self.terms
        terms.append((white, state / variance, sum(each * each for each in values) / unit))
        self.white += white
        self.state += state / variance
        if len(terms) > WINDOW:
            old_white, old_state, _ = terms.popleft()
            self.white -= old_white
            self.state -= old_state

    def remember(self, values: list[float], variance: list[float], state: float) -> None:
        """Remember a reading, also one beyond the gate."""
        units = [min(max(each / sqrt(own), -_LARGEST), _LARGEST) for each, own in zip(values, variance, strict=True)]
        self.recent.append((units, state * len(variance) / sum(variance)))

    def is_noisy(self, false_alarm: float) -> bool:
        """Whether the readings within the gate have more white noise than the parameter predicts."""
        count = len(self.terms)
        return count >= LEAST and self.white > _largest_ratio(count, false_alarm) * (count + self.state)

    def is_noisy_beyond_gate(self, false_alarm: float) -> bool:
        """The same of all readings but outliers."""
        if len(self.recent) < LEAST:
            return False
        found, state = self._found()
        count = len(found.kept) - 1
        return found.is_white and found.variance > _largest_ratio(count, false_alarm) * (1.0 + state)

    def _found(self, count: int = WINDOW) -> tuple[WhiteNoise, float]:
        """Noise of the last readings, and the mean variance of what was expected."""
        recent = list(self.recent)[-count:]
        found = white_noise(np.array([values for values, _ in recent]))
        return found, sum(recent[place][1] for place in found.kept) / len(found.kept)

    @property
    def is_learning(self) -> bool:
        """Whether the noise is larger than the parameter says, and not yet averaged over a whole window."""
        return self.factor > 1.0 and len(self.recent) < WINDOW

    def estimate(self) -> None:
        """Take the factor from the readings; the first from the last few, too, which the window then starts with."""
        count = len(self.recent)
        found, state = self._found()
        if self.factor == 1.0:
            latest, expected = self._found(LEAST)
            within = (self.white - self.state) / max(1, len(self.terms))
            self.factor = max(1.0, found.variance - state, latest.variance - expected, within)
            while len(self.recent) > LEAST:
                self.recent.popleft()
            self._restart_terms()
        elif count >= LEAST:
            is_well = count >= WINDOW and found.variance <= RETURN * (1.0 + state)
            self.factor = 1.0 if is_well else max(1.0, found.variance - state)
            if is_well:
                self._restart_terms()

    def _restart_terms(self) -> None:
        self.terms.clear()
        self.white, self.state = 0.0, 0.0

    def is_white(self, count: int) -> bool:
        """Whether the last readings, also beyond the gate, differ from one to the next as much as they spread."""
        values = np.array([values for values, _ in list(self.recent)[-count:]])
        if len(values) < count:
            return False
        return float(np.mean(np.diff(values, axis=0) ** 2)) / 2.0 > ALIKE * float(np.mean(values**2))


class AdaptiveNoise:
    """Noise of the sensors in use, as a factor on the variance of each: one until a sensor shows more."""

    def __init__(self) -> None:
        """Every sensor as its parameter says."""
        self._sensors: dict[str, _SensorNoise] = {}
        self._noisy: dict[str, float] = {}
        self._reported: set[str] = set()
        """Sensors whose latest report is that they are noisy."""
        self._contributions = np.zeros((0, 6, 6))
        """(s, 6, 6) of the recent readings of each sensor to the covariance after the last update."""
        self._transition = np.eye(6)
        """(6, 6) since then."""
        self._excess: dict[str, float] = {}
        """Growth of the contribution of each sensor that the covariance is to be corrected by."""

    def scaled(self, variance: dict[str, tuple[float, ...]]) -> dict[str, tuple[float, ...]]:
        """Variances of the noise of each value by sensor, as they are found to be; the argument while all are well."""
        if not self._noisy:
            return variance
        return {name: tuple(each * self._noisy.get(name, 1.0) for each in values) for name, values in variance.items()}

    def propagate(self, transition: Matrix) -> None:
        """Propagate by a transition matrix (6, 6)."""
        accumulate_transition(self._transition, transition)

    def add(
        self, readings: Readings, innovation: Vector, variance: Vector, jacobian: Matrix, covariance: Matrix
    ) -> None:
        """Add readings within the gate, after the update with them.

        Args:
            readings: with m values in all.
            innovation: (m,).
            variance: predicted, of each innovation, (m,).
            jacobian: (m, 6).
            covariance: (6, 6) after the update.
        """
        values, total, noise = innovation.tolist(), variance.tolist(), readings.variance.tolist()
        places = np.empty(readings.model.size, dtype=np.int64)
        for name, rows in zip(readings.model.sensors, readings.model.rows, strict=True):
            sensor = self._sensor(name)
            places[rows] = sensor.place
            own, state = _split(noise[rows], total[rows], sensor.factor)
            sensor.remember(values[rows], own, state)
            size = rows.stop - rows.start
            mean = sum(noise[rows]) / size
            sensor.add(values[rows], mean, sum(total[rows]) / size - mean)
        update_contributions(
            self._contributions, places, MEMORY, self._transition, covariance, jacobian, readings.variance
        )
        self._transition = _IDENTITY.copy()
        for name in readings.model.sensors:
            sensor = self._sensors[name]
            if sensor.factor > 1.0 or sensor.is_noisy(FALSE_ALARM):
                self._estimate(name, sensor)
        if self._excess:  # one noisy sensor casts suspicion on the others: corrected together
            self.explains_excess()

    def reject(self, name: str, values: list[float], noise: list[float], total: list[float]) -> None:
        """Add a reading beyond the gate: innovations, variances of the noise, and predicted ones of the innovations."""
        sensor = self._sensor(name)
        own, state = _split(noise, total, sensor.factor)
        sensor.remember(values, own, state)
        if sensor.factor > 1.0 or sensor.is_noisy_beyond_gate(FALSE_ALARM):
            self._estimate(name, sensor)

    def _sensor(self, name: str) -> _SensorNoise:
        sensor = self._sensors.get(name)
        if sensor is None:
            sensor = self._sensors[name] = _SensorNoise(len(self._sensors))
            self._contributions = np.concatenate([self._contributions, np.zeros((1, 6, 6))])
        return sensor

    def explains_excess(self) -> bool:
        """Whether noise or outliers explain a NIS that is too large; noise found is adapted.

        They do if at least half of the excess is white.
        """
        terms = [term for sensor in self._sensors.values() for term in list(sensor.terms)[-JUDGED:]]
        white, state, square = map(sum, zip(*terms, strict=True)) if terms else (0.0, 0.0, 0.0)
        predicted = len(terms) + state
        is_explained = white - predicted >= 0.5 * (square - predicted)
        for name, sensor in self._sensors.items():
            if sensor.factor == 1.0 and (sensor.is_noisy(SUSPICION) or sensor.is_noisy_beyond_gate(SUSPICION)):
                self._estimate(name, sensor)
            is_explained |= sensor.is_learning
        return is_explained

    def are_white(self, names: Iterable[str], count: int) -> bool:
        """Whether the last innovations of most of these sensors are white: noise or outliers, no error of the state."""
        white = [self._sensor(name).is_white(count) for name in names]
        return 2 * sum(white) >= len(white)

    def forget_readings(self) -> None:
        """Forget the innovations so far, also beyond the gate, which an inflation explains as an error of the state."""
        for sensor in self._sensors.values():
            sensor.recent.clear()

    def _estimate(self, name: str, sensor: _SensorNoise) -> None:
        sensor.estimate()
        if sensor.factor > 1.0:
            self._noisy[name] = sensor.factor
            if sensor.factor > GROWTH * sensor.believed:
                self._excess[name] = self._excess.get(name, 1.0) * sensor.factor / sensor.believed
                sensor.believed = sensor.factor
        else:
            self._noisy.pop(name, None)
            sensor.believed = 1.0

    def correct(self, covariance: Matrix) -> Matrix:
        """Covariance (6, 6) with the errors of readings that were weighted too much.

        A sensor whose noise has f times the variance that its readings were weighted with contributes f times as
        much as it was taken to: P' = P + (f - 1) C.
        """
        if not self._excess:
            return covariance
        growth = np.zeros((6, 6))
        for name, factor in self._excess.items():
            place = self._sensors[name].place
            growth += (factor - 1.0) * self._contributions[place]
            self._contributions[place] *= factor
        self._excess = {}
        corrected: Matrix = covariance + self._transition @ growth @ self._transition.T
        restore_definiteness(corrected)
        return corrected

    def take_reports(self) -> list[tuple[str, str]]:
        """Subject and detail of each change of a sensor's noise that is worth an event."""
        if not (self._noisy or self._reported):
            return []
        reports = []
        for name, sensor in self._sensors.items():
            sigma = sqrt(sensor.factor)
            is_new = (sigma == 1.0) != (sensor.reported == 1.0)
            if is_new or max(sigma / sensor.reported, sensor.reported / sigma) > REPORTED_AGAIN:
                sensor.reported = sigma
                is_noisy = sigma > 1.0
                (self._reported.add if is_noisy else self._reported.discard)(name)
                detail = f"noise {sigma:.2g} times {name}_sigma: weighted so" if is_noisy else "noise as assumed again"
                reports.append((name, detail))
        return reports


def _split(noise: list[float], total: list[float], factor: float) -> tuple[list[float], float]:
    """Variances of the noise as the parameter says, and the mean variance of the expected values."""
    return [each / factor for each in noise], (sum(total) - sum(noise)) / len(noise)


@cache
def _largest_ratio(count: int, false_alarm: float) -> float:
    """Largest mean of half the squared successive differences of unit white noise, (count,).

    Its cumulants are those of a quadratic form with eigenvalues 1 - cos: n, 3 n and 20 n of the sum of n; the
    chi-square distribution that has the same three, scaled and shifted (Hall 1983), gives the tail.
    """
    freedom = 0.54 * count
    return 1.0 + (float(chdtri(freedom, false_alarm)) - freedom) / 0.6 / count
