"""Compute per tick of the control laws; MPC beside the bare solver, and others, on the same QPs."""

from collections.abc import Callable, Iterator
from time import thread_time
from typing import Any

import daqp
import numpy as np
import osqp
import piqp
from numpy.typing import NDArray

from bench.result import Result
from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.control.controller import Controller, Vehicle
from formation_gnc.control.mpc import ModelPredictiveController, MpcParameters
from formation_gnc.control.plan_solver import SETTINGS
from formation_gnc.control.registry import ALGORITHMS, FINITE_HORIZONS
from formation_gnc.control.weights import QuadraticWeights
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.hill import HillModel
from formation_gnc.types import NANOSECONDS

TICKS = 3000
OFTEN = 20.0
"""s between the plans of a reconfiguration in 3000 s: more of them than a scenario has, for a percentile."""
MISSION = CommonParameters(Orbit(6978100.0), tick=1.0)
VEHICLE = Vehicle(100.0, np.full(3, 0.01))
CHIEF = state_from_elements(Elements(**vars(MISSION.chief)))
START = np.array([40.0, -30.0, 20.0, 0.0, 0.0, 0.0])
BRYSON: dict[str, Any] = {
    "position_error": (10.0,) * 3,
    "velocity_error": (0.1,) * 3,
    "thrust": (0.002,) * 3,
}


def laws() -> Iterator[tuple[str, Controller[Any]]]:
    """All laws by name, and some with other parameters."""
    others = [("sdre", {"update_interval": 0.0}), ("hinf", {"form": "full_information"})]
    for name, own in [*((name, dict[str, Any]()) for name in ALGORITHMS), *others]:
        kind = ALGORITHMS[name]
        weights = BRYSON if issubclass(kind.Parameters, QuadraticWeights) else {}
        often = {"replan_interval": OFTEN} if name in FINITE_HORIZONS else {}
        label = ", ".join([name, *(f"{key} {value}" for key, value in own.items())])
        yield label, kind(kind.Parameters(**weights, **often, **own), MISSION, VEHICLE)


def fly(law: Controller[Any], start: NDArray[np.float64] = START) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Compute time of each command, s of this thread, over a noisy flight, and which of them made a plan.

    From `START`, at the thrust limit.
    """
    noise = np.random.default_rng(1).standard_normal((TICKS, 6)) * np.repeat([0.1, 1e-4], 3)
    phi, gamma = HillModel(MISSION.mean_motion).discretise(0.0, MISSION.tick)
    state, times, plans = start, np.empty(TICKS), np.empty(TICKS, dtype=np.bool_)
    nowhere = np.empty((0, 6))
    for tick in range(TICKS):
        time = tick * NANOSECONDS
        seen = NavigationState(time, state + noise[tick], CHIEF, 100.0)
        aim = Target(time, "", np.zeros(6), 60 * NANOSECONDS, nowhere)
        started = thread_time()
        command = law.command(seen, aim)
        times[tick] = thread_time() - started
        plans[tick] = command.iterations > 0
        state = phi @ state + gamma @ np.clip(command.force, -0.01, 0.01) / 100.0
    return times, plans


def qps() -> tuple[NDArray[np.float64], list[dict[str, Any]], tuple[Any, Any]]:
    """Times of the MPC's commands, the QPs that it solved, and their matrices."""
    law = ModelPredictiveController(MpcParameters(**BRYSON), MISSION, VEHICLE)
    solver, asked = law.solver.workspace, []

    class Recorder:
        """The solver, with a record of its updates."""

        def update(self, **values: Any) -> None:
            asked.append(values)
            solver.update(**values)

        def __getattr__(self, name: str) -> Any:
            return getattr(solver, name)

    law.solver.workspace = Recorder()
    fly(law)
    plain = ModelPredictiveController(MpcParameters(**BRYSON), MISSION, VEHICLE)
    return fly(plain)[0], asked, law.solver.matrices


def solve_all(asked: list[dict[str, Any]], solve: Callable[[dict[str, Any]], Any]) -> NDArray[np.float64]:
    """Compute time of each QP, s of this thread."""
    times = np.empty(len(asked))
    for index, values in enumerate(asked):
        started = thread_time()
        solve(values)
        times[index] = thread_time() - started
    return times


def others(matrices: tuple[Any, Any]) -> dict[str, Callable[[dict[str, Any]], Any]]:
    """Other solvers by name, each from a cold start."""
    upper = matrices[0].toarray()
    hessian = upper + np.triu(upper, 1).T
    kinds = np.zeros(matrices[1].shape[0], dtype=np.intc)
    nothing = np.empty((0, len(hessian)))
    interior = piqp.DenseSolver()
    bounds = np.ones(len(hessian))
    interior.setup(hessian, 0.0 * bounds, None, None, None, None, None, -bounds, bounds)

    def with_piqp(values: dict[str, Any]) -> Any:
        interior.update(c=values["q"], x_l=values["l"], x_u=values["u"])
        return interior.solve()

    return {
        "DAQP": lambda values: daqp.solve(hessian, values["q"], nothing, values["u"], values["l"], kinds),
        "PIQP": with_piqp,
    }


def run() -> list[Result]:
    """All figures of the control laws, in microseconds of compute."""
    ticks, asked, matrices = qps()
    bare = osqp.OSQP()
    rows = matrices[1].shape[0]
    bare.setup(matrices[0], asked[0]["q"], matrices[1], np.full(rows, -1.0), np.full(rows, 1.0), **SETTINGS)

    def with_osqp(values: dict[str, Any]) -> Any:
        bare.update(**values)
        return bare.solve(raise_error=False)

    alone = solve_all(asked, with_osqp)
    micro = 1e6
    p99, median = float(np.percentile(ticks, 99)) * micro, float(np.median(ticks)) * micro
    osqp_median = float(np.median(alone)) * micro
    results = [
        Result("MPC tick, 30 steps, 99th percentile against 1 ms", p99, 1000.0, "us", p99 / 1000.0, "<= 1"),
        Result("MPC tick against bare OSQP, median", median, osqp_median, "us", median / osqp_median, "<= 1.5"),
    ]
    for name, solver in others(matrices).items():
        theirs = float(np.median(solve_all(asked, solver))) * micro
        results.append(
            Result(
                f"OSQP, warm, against {name}, cold, median",
                osqp_median,
                theirs,
                "us",
                osqp_median / theirs,
                "",
            )
        )
    for label, law in laws():
        own, plans = fly(law, START / 10.0)
        for kind, times in (("tick", own[~plans]), ("tick with a plan", own[plans])):
            for word, share in (("median", 50.0), ("p99", 99.0)) if times.size else ():
                taken, theirs = (micro * float(np.percentile(each, share)) for each in (times, ticks))
                results.append(Result(f"{label}: {kind}, {word} / MPC's", taken, theirs, "us", taken / theirs, ""))
    return results
