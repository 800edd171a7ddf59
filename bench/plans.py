"""Compute of one plan: every law with a final time, in the cases in which `verification` flies it."""

from time import thread_time

import numpy as np
from numpy.typing import NDArray

from bench.result import Result
from formation_gnc.control.registry import FINITE_HORIZONS
from formation_gnc.orbit.elements import state_from_elements
from verification.control import estimate
from verification.seeds.over_optimum import CASES, MASS, START, Case, chief_of, ellipse, planner

PLANS = 100
TICK = 1.0
"""What a plan is to be made in, s."""


def first_plans(name: str, case: Case) -> NDArray[np.float64]:
    """Compute time of first commands, s of this thread: 100 steps of 20 s, from no guess."""
    eccentricity, oblate, rho = case
    seen = estimate(0.0, START, state_from_elements(chief_of(eccentricity)), MASS)
    aim, times = ellipse(rho)(0.0), np.empty(PLANS)
    for index in range(PLANS):
        law = planner(name, eccentricity, oblate)
        started = thread_time()
        answer = law.command(seen, aim)
        times[index] = thread_time() - started
        if answer.solver != "planned":
            raise RuntimeError(f"{name}: {answer.fallback}")
    return times


def run() -> list[Result]:
    """Medians beside those of one linear problem, 99th percentiles beside a tick; ms of compute."""
    results = []
    for case in CASES:
        eccentricity, oblate, rho = case
        words = f"plan, {rho:g} km, e = {eccentricity:g}{', J2' if oblate else ''}"
        taken = {name: 1e3 * first_plans(name, case) for name in FINITE_HORIZONS}
        linear, tick = float(np.median(taken["sdre_finite"])), 1e3 * TICK
        for name, times in taken.items():
            median, late = float(np.median(times)), float(np.percentile(times, 99))
            results += [
                Result(f"{name}: {words}, median / sdre_finite's", median, linear, "ms", median / linear, ""),
                Result(f"{name}: {words}, p99 / tick of {TICK:g} s", late, tick, "ms", late / tick, "<= 1"),
            ]
    return results
