"""The navigation filter beside bare FilterPy with the same compiled motion and measurement functions."""

from dataclasses import replace
from itertools import pairwise
from math import radians
from time import perf_counter

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter
from numpy.typing import NDArray

from bench.result import Result
from formation_gnc.common import Orbit
from formation_gnc.navigation.filters import ExtendedFilter
from formation_gnc.navigation.kernels.measurement import measure_relative
from formation_gnc.navigation.measurement import Readings, measurement_model
from formation_gnc.navigation.parameters import NavigationParameters
from formation_gnc.navigation.process import Interval, NonlinearProcess, process_noise
from formation_gnc.navigation.state_history import StateHistory
from formation_gnc.sil.monte_carlo import navigation_filter, simulate_measurements

Array = NDArray[np.float64]

ROUNDS = 25


class _Bare(ExtendedKalmanFilter):  # type: ignore[misc]
    """FilterPy's filter as a user writes it down: a nonlinear prediction, and its own covariance."""

    def predict_over(self, interval: Interval, no_noise: Array) -> None:
        self.predicted, _, self.F = NonlinearProcess().predict(interval, self.x, self.P, no_noise)
        self.predict()

    def predict_x(self, u: float = 0) -> None:
        self.x = self.predicted


def run() -> list[Result]:
    """Mean time of a tick, readings at every tenth: the best of many for each tick.

    The filter's step is prediction, the gate's variances, update, and the check that the covariance is
    positive definite; a whole tick adds the checks of what comes in, the chief's ephemeris, divergence,
    observability and the estimate.
    """
    parameters = NavigationParameters(chief=Orbit(6978100.0, inclination=radians(50.0)), tick=1.0)
    samples = [each.measurement for each in simulate_measurements(parameters, 600, np.random.default_rng(1))]
    every_tenth = [each if index % 10 == 0 else replace(each, readings=[]) for index, each in enumerate(samples)]
    noise, no_noise = process_noise(1e-14, 1.0), np.zeros((6, 6))
    covariance = np.diag(np.repeat([0.25, 2.5e-7], 3))
    model, variance = measurement_model(("radius", "range_rate", "latitude")), np.array([25.0, 1e-4, 1e-12])
    process, history = NonlinearProcess(), StateHistory(60)
    intervals = [
        Interval(one.chief_state, other.chief_state, np.zeros(3), 1.0, 1) for one, other in pairwise(every_tenth)
    ]

    def bare() -> Array:
        filter = _Bare(6, 3)
        filter.x, filter.P, filter.Q, filter.R = samples[0].fix, covariance, noise, np.diag(variance)
        times = np.empty(len(intervals))
        for index, (interval, measurement) in enumerate(zip(intervals, every_tenth[1:], strict=True)):
            begun = perf_counter()
            filter.predict_over(interval, no_noise)
            if measurement.readings:
                filter.update(
                    np.array([each.values[0] for each in measurement.readings]),
                    lambda x, chief=interval.next_chief: measure_relative(model.codes, chief, x)[1],
                    lambda x, chief=interval.next_chief: measure_relative(model.codes, chief, x)[0],
                )
            times[index] = perf_counter() - begun
        return times

    def step() -> Array:
        filter = ExtendedFilter(samples[0].fix, covariance)
        times = np.empty(len(intervals))
        for index, (interval, measurement) in enumerate(zip(intervals, every_tenth[1:], strict=True)):
            begun = perf_counter()
            filter.predict(process, interval, noise)
            if measurement.readings:
                values = np.array([each.values[0] for each in measurement.readings])
                chief = interval.next_chief
                filter.linearize(Readings(model, values, [0.0] * 3, variance, chief, history, late=False))
                filter.update(pseudo=False)
            times[index] = perf_counter() - begun
        return times

    def whole() -> Array:
        filter = navigation_filter(parameters)
        filter.on_tick(every_tenth[0])
        times = np.empty(len(intervals))
        for index, measurement in enumerate(every_tenth[1:]):
            begun = perf_counter()
            filter.on_tick(measurement)
            times[index] = perf_counter() - begun
        return times

    best = {each.__name__: np.full(len(intervals), np.inf) for each in (bare, step, whole)}
    for _ in range(ROUNDS):  # interleaved, so that a busy machine is busy for all
        for each in (bare, step, whole):
            best[each.__name__] = np.minimum(best[each.__name__], each())
    theirs, step_time, whole_time = (float(1e6 * best[name].mean()) for name in ("bare", "step", "whole"))
    return [
        Result("filter's step over bare FilterPy", step_time, theirs, "us", step_time / theirs, "<= 1.3"),
        Result("navigation filter's tick over bare FilterPy", whole_time, theirs, "us", whole_time / theirs, ""),
    ]
