"""Noise of each sensor, adapted to what its innovations show.

White innovations that are too large are a sensor's noise; innovations that are too large and alike from one to the
next are an error of the state, which is left to the checks of consistency. Half the mean squared difference of
successive innovations is the variance of the white part alone (von Neumann 1941).
"""

from collections import deque
from dataclasses import dataclass, field
from functools import cache
from math import sqrt

import numpy as np
from scipy.special import chdtri

from formation_gnc.navigation.kernels.linear_algebra import accumulate_information, restore_definiteness
from formation_gnc.navigation.measurement import Readings
from formation_gnc.types import Matrix, Vector

WINDOW = 60
"""Differences of innovations over which a sensor's noise is averaged: a standard error of a ninth, of sigma."""

LEAST = 12
"""Differences before anything is concluded."""

FALSE_ALARM = 1e-6
"""Probability that the window of a sensor as noisy as its parameter says counts as noisier."""

SUSPICION = 1e-3
"""The same once the NIS of all sensors is too large, so that there is something to explain."""

GROWTH = 1.5
"""Growth of the factor beyond which the readings so far have been weighted too much."""

RETURN = 1.2
"""Variance, over what the parameter predicts, below which a noisier sensor counts as well again."""

REPORTED_AGAIN = 2.0
"""Change of the standard deviation, as a factor, after which it is reported again."""


@dataclass(slots=True)
class _SensorNoise:
    """Window of a sensor; squared differences and predictions are over the variance that the parameter says."""

    factor: float = 1.0
    """Estimated variance of the noise, over that of the parameter; one or more."""
    last: list[float] = field(default_factory=list)
    terms: deque[tuple[float, float, int]] = field(default_factory=deque)
    white: float = 0.0
    """Sum of half the squared differences."""
    state: float = 0.0
    """Sum of the variances of the expected readings."""
    beyond: int = 0
    """Readings beyond the gate in the window."""
    new_beyond: int = 0
    """Of these, since the last reading within."""
    reported: float = 1.0
    believed: float = 1.0
    """Factor that the covariance reckons with."""
    information: Matrix = field(default_factory=lambda: np.zeros((6, 6)))
    """Of the readings in the window of observability, by the weight that each has had, over the factor then."""

    def add(self, values: list[float], variance: float, state: float) -> None:
        """Add a reading's innovations, with the mean variance of the noise and that of the expected values."""
        last, self.last = self.last, values
        if len(last) != len(values):
            return
        white = sum((new - old) ** 2 for new, old in zip(values, last, strict=True)) / (2.0 * variance * len(values))
        terms = self.terms
        terms.append((white, state / variance, self.new_beyond))
        self.beyond += self.new_beyond
        self.new_beyond = 0
        self.white += white
        self.state += state / variance
        if len(terms) > WINDOW:
            old_white, old_state, old_beyond = terms.popleft()
            self.beyond -= old_beyond
            self.white -= old_white
            self.state -= old_state

    def is_noisy(self, false_alarm: float) -> bool:
        """Whether the window has more white noise than the parameter predicts."""
        count = len(self.terms)
        return count >= LEAST and self.white > _largest_ratio(count, false_alarm) * (count + self.state)

    @property
    def is_learning(self) -> bool:
        """Whether the noise is larger than the parameter says, and not yet averaged over a whole window."""
        return self.factor > 1.0 and len(self.terms) < WINDOW

    def estimate(self, gate: float) -> None:
        """Take the factor from the window.

        The gate, a square as in `reading_update`, has cut the innovations of a sensor that is found noisier: how many
        are beyond it says how wide they spread, and its window starts again.
        """
        count = len(self.terms)
        if self.factor == 1.0:
            share = self.beyond / (self.beyond + count)
            spread = gate / chdtri(1, share) if share > 0.0 else 1.0
            self.factor = max(1.0, (self.white - self.state) / count, spread)
            self.terms.clear()
            self.white, self.state, self.beyond = 0.0, 0.0, 0
        elif count >= LEAST:
            is_well = count >= WINDOW and self.white <= RETURN * (count + self.state)
            self.factor = 1.0 if is_well else max(1.0, (self.white - self.state) / count)


class AdaptiveNoise:
    """Noise of the sensors in use, as a factor on the variance of each: one until a sensor shows more."""

    def __init__(self) -> None:
        """Every sensor as its parameter says."""
        self._sensors: dict[str, _SensorNoise] = {}
        self._noisy: dict[str, float] = {}
        self._excess = np.zeros((6, 6))
        self._has_grown = False

    def scaled(self, variance: dict[str, tuple[float, ...]]) -> dict[str, tuple[float, ...]]:
        """Variances of the noise of each value by sensor, as they are found to be; the argument while all are well."""
        if not self._noisy:
            return variance
        return {name: tuple(each * self._noisy.get(name, 1.0) for each in values) for name, values in variance.items()}

    def add(
        self,
        readings: Readings,
        innovation: Vector,
        variance: Vector,
        jacobian: Matrix,
        transition: Matrix,
        gate: float,
    ) -> None:
        """Add readings within the gate.

        Args:
            readings: with m values in all.
            innovation: (m,).
            variance: predicted, of each innovation, (m,).
            jacobian: (m, 6).
            transition: (6, 6), since the start of the window of observability.
            gate: largest accepted innovation squared over its variance.
        """
        values, total, noise = innovation.tolist(), variance.tolist(), readings.variance.tolist()
        for name, rows in zip(readings.model.sensors, readings.model.rows, strict=True):
            sensor = self._sensors.setdefault(name, _SensorNoise())
            size = rows.stop - rows.start
            own = sum(noise[rows]) / size
            sensor.add(values[rows], own / sensor.factor, sum(total[rows]) / size - own)
            weight = readings.variance[rows] * sensor.factor
            accumulate_information(sensor.information, jacobian[rows], transition, weight)
            if sensor.factor > 1.0 or sensor.is_noisy(FALSE_ALARM):
                self._estimate(name, sensor, gate)
        if self._has_grown:  # one noisy sensor casts suspicion on the others: corrected together
            self.explains_excess(gate)

    def reject(self, sensor: str) -> None:
        """Count a reading beyond the gate."""
        self._sensors.setdefault(sensor, _SensorNoise()).new_beyond += 1

    def explains_excess(self, gate: float) -> bool:
        """Whether sensors noisier than their parameters explain a NIS that is too large; their noise is adapted."""
        is_explained = False
        for name, sensor in self._sensors.items():
            if sensor.factor == 1.0 and sensor.is_noisy(SUSPICION):
                self._estimate(name, sensor, gate)
            is_explained |= sensor.is_learning
        return is_explained

    def _estimate(self, name: str, sensor: _SensorNoise, gate: float) -> None:
        sensor.estimate(gate)
        if sensor.factor > 1.0:
            self._noisy[name] = sensor.factor
            if sensor.factor > GROWTH * sensor.believed:
                self._has_grown = True
                self._excess += (sensor.factor - sensor.believed) * sensor.information
                sensor.believed = sensor.factor
        else:
            self._noisy.pop(name, None)
            sensor.believed = 1.0

    def correct(self, covariance: Matrix, transition: Matrix) -> Matrix:
        """Covariance (6, 6) with the errors of readings that were weighted too much.

        An estimate that gave readings of information M the weight of one variance, which was f times as large,
        errs by P' = P + (f - 1) P M P. `transition` (6, 6) is that since the start of the window.
        """
        if not self._has_grown:
            return covariance
        self._has_grown = False
        seen = np.linalg.solve(transition, covariance)  # Phi^-1 P
        corrected: Matrix = covariance + seen.T @ self._excess @ seen
        self._excess = np.zeros((6, 6))
        self.begin_window()
        restore_definiteness(corrected)
        return corrected

    def begin_window(self) -> None:
        """Begin another window of observability, to whose start information refers."""
        for sensor in self._sensors.values():
            sensor.information = np.zeros((6, 6))

    def take_reports(self) -> list[tuple[str, str]]:
        """Subject and detail of each change of a sensor's noise that is worth an event."""
        if not self._noisy and all(sensor.reported == 1.0 for sensor in self._sensors.values()):
            return []
        reports = []
        for name, sensor in self._sensors.items():
            sigma = sqrt(sensor.factor)
            is_new = (sigma == 1.0) != (sensor.reported == 1.0)
            if is_new or max(sigma / sensor.reported, sensor.reported / sigma) > REPORTED_AGAIN:
                sensor.reported = sigma
                is_noisy = sigma > 1.0
                detail = f"noise {sigma:.2g} times {name}_sigma: weighted so" if is_noisy else "noise as assumed again"
                reports.append((name, detail))
        return reports


@cache
def _largest_ratio(count: int, false_alarm: float) -> float:
    """Largest mean of half the squared successive differences of unit white noise, (count,).

    Its cumulants are those of a quadratic form with eigenvalues 1 - cos: n, 3 n and 20 n of the sum of n; the
    chi-square distribution that has the same three, scaled and shifted (Hall 1983), gives the tail.
    """
    freedom = 0.54 * count
    return 1.0 + (float(chdtri(freedom, false_alarm)) - freedom) / 0.6 / count
