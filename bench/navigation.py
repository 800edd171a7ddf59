"""The navigation filter beside bare FilterPy, which flies and reads with the same compiled functions."""

from dataclasses import replace
from itertools import pairwise
from math import radians
from time import perf_counter

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter
from numpy.typing import NDArray

from bench.result import Result
from formation_gnc.common import Orbit
from formation_gnc.navigation import kernels
from formation_gnc.navigation.filters import ExtendedFilter
from formation_gnc.navigation.measurement import Readings, StateHistory
from formation_gnc.navigation.navigation_filter import NavigationParameters
from formation_gnc.navigation.process import Interval, NonlinearProcess, process_noise
from formation_gnc.sil.monte_carlo import navigator, simulate_measurements

Array = NDArray[np.float64]

ROUNDS = 25


class _Bare(ExtendedKalmanFilter):  # type: ignore[misc]
    """FilterPy's filter as a user writes it down: a nonlinear prediction, and its own covariance."""

    def fly(self, leg: Interval, nothing: Array) -> None:
        self.moved, _, self.F = NonlinearProcess().predict(leg, self.x, self.P, nothing)
        self.predict()

    def predict_x(self, u: float = 0) -> None:
        self.x = self.moved


def run() -> list[Result]:
    """Mean time of a tick, readings at every tenth: the best of many for each tick.

    The filter's step is prediction, the gate's variances, update, and the check that the covariance is
    positive definite; a whole tick adds the checks of what comes in, the chief's ephemeris, divergence,
    observability and the estimate.
    """
    parameters = NavigationParameters(chief=Orbit(6978100.0, inclination=radians(50.0)), tick=1.0)
    samples = [each.measurement for each in simulate_measurements(parameters, 600, np.random.default_rng(1))]
    every_tenth = [each if index % 10 == 0 else replace(each, readings=[]) for index, each in enumerate(samples)]
    noise, nothing = process_noise(1e-14, 1.0), np.zeros((6, 6))
    covariance = np.diag(np.repeat([0.25, 2.5e-7], 3))
    sensors, variance = np.array([0, 1, 2]), np.array([25.0, 1e-4, 1e-12])
    process, track = NonlinearProcess(), StateHistory(60)
    legs = [Interval(one.chief_state, other.chief_state, np.zeros(3), 1.0, 1) for one, other in pairwise(every_tenth)]

    def bare() -> Array:
        filter = _Bare(6, 3)
        filter.x, filter.P, filter.Q, filter.R = samples[0].fix, covariance, noise, np.diag(variance)
        times = np.empty(len(legs))
        for index, (leg, measurement) in enumerate(zip(legs, every_tenth[1:], strict=True)):
            begun = perf_counter()
            filter.fly(leg, nothing)
            if measurement.readings:
                filter.update(
                    np.array([each.values[0] for each in measurement.readings]),
                    lambda x, chief=leg.next_chief: kernels.read_relative(sensors, chief, x)[1],
                    lambda x, chief=leg.next_chief: kernels.read_relative(sensors, chief, x)[0],
                )
            times[index] = perf_counter() - begun
        return times

    def step() -> Array:
        filter = ExtendedFilter(samples[0].fix, covariance)
        times = np.empty(len(legs))
        for index, (leg, measurement) in enumerate(zip(legs, every_tenth[1:], strict=True)):
            begun = perf_counter()
            filter.fly(process, leg, noise)
            if measurement.readings:
                filter.weigh(
                    Readings(
                        sensors,
                        np.array([each.values[0] for each in measurement.readings]),
                        nothing[0, :3],
                        variance,
                        leg.next_chief,
                        track,
                        False,
                    )
                )
                filter.correct(pseudo=False)
            times[index] = perf_counter() - begun
        return times

    def whole() -> Array:
        part = navigator(parameters)
        part.on_tick(every_tenth[0])
        times = np.empty(len(legs))
        for index, measurement in enumerate(every_tenth[1:]):
            begun = perf_counter()
            part.on_tick(measurement)
            times[index] = perf_counter() - begun
        return times

    best = {each.__name__: np.full(len(legs), np.inf) for each in (bare, step, whole)}
    for _ in range(ROUNDS):  # interleaved, so that a busy machine is busy for all
        for each in (bare, step, whole):
            best[each.__name__] = np.minimum(best[each.__name__], each())
    theirs, step_time, whole_time = (float(1e6 * best[name].mean()) for name in ("bare", "step", "whole"))
    return [
        Result("filter's step over bare FilterPy", step_time, theirs, "us", step_time / theirs, "<= 1.3"),
        Result("navigator's tick over bare FilterPy", whole_time, theirs, "us", whole_time / theirs, ""),
    ]
