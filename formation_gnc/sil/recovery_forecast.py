"""Whether the law of each deputy takes back the error at the start, before flying."""

from dataclasses import dataclass, replace
from math import isfinite, tau

import numpy as np

from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.control.models import transfer_model
from formation_gnc.control.mpc import MpcParameters
from formation_gnc.errors import ConfigurationError
from formation_gnc.guidance.slots import SlotAssigner, design_path
from formation_gnc.guidance.targets import TargetPath
from formation_gnc.guidance.transfer import delta_v, shortest_time
from formation_gnc.orbit.elements import state_from_elements
from formation_gnc.records import NavigationState, Target
from formation_gnc.relative.chief import KeplerChief
from formation_gnc.sil.scenario import Scenario
from formation_gnc.types import Vector

POINTS = 500
"""Least ticks per revolution of the forecast, which need not be as short as those of the flight."""

REVOLUTIONS = 3.0
"""Least time of a forecast, in revolutions."""

PATIENCE = 5.0
"""Longest time to recover over the least possible."""

RECOVERED = 0.1
"""Share of the error at the start below which it is taken back."""

SMALL = 1.0
"""Error (m, and by the orbital rate m/s) that counts as none."""

FULL = 0.999
"""Share of the limit, but for a solver's accuracy, that counts as thrust at the limit."""

PLANNED = "planned"
"""Solver status of a law that has made a plan to its final time."""

REMEDY = "lqr"
"""A law that recovers from any error within reach."""


@dataclass(frozen=True)
class Forecast:
    """Outcome of a law on its own relative model."""

    time: float
    """Time to recover, s; inf if it does not."""
    distance: float
    """From the target at the end, m."""
    saturated: float
    """Share of ticks at the thrust limit."""


def initial_errors(scenario: Scenario) -> dict[str, Vector]:
    """(6,) true state less target of every deputy at the start, Hill frame, m and m/s."""
    plant = scenario.plant
    chief = state_from_elements(plant.chief_elements)
    states = {
        name: NavigationState(0, np.array(body.relative_state), chief, body.mass) for name, body in plant.deputy.items()
    }
    errors, assigned = dict[str, Vector](), dict[str, TargetPath]()
    for name, modules in scenario.deputies.items():
        parameters = modules["guidance"]
        if parameters.assignment == "fixed":
            path = design_path(parameters)
        else:
            if name not in assigned:
                slots = SlotAssigner()
                slots.assign(parameters, 0, states)
                assigned |= slots.paths
            path = assigned.get(name) or design_path(parameters)
        errors[name] = states[name].relative_state - path.anchored(chief, 0.0).states(np.zeros(1))[0]
    return errors


def forecast(parameters: ControllerParameters, error: Vector, duration: float) -> Forecast:
    """Fly the law from an error (6,) to a target at the chief, on the linear model, for at most a duration (s).

    Without its dead band, in which an error is to stay.

    Raises:
        ConfigurationError: the parameters admit no law.
    """
    parameters = replace(parameters, dead_band=(0.0,) * len(parameters.dead_band))
    try:
        coarse = replace(parameters, tick=_tick(parameters))
        manager = ControllerManager("/forecast", coarse)
    except ConfigurationError:
        coarse = parameters
        manager = ControllerManager("/forecast", coarse)
    model, tick, ellipse = transfer_model(coarse), coarse.tick, KeplerChief.of(coarse.chief_elements)
    steady = model.discretise(0.0, tick) if model.is_time_invariant else None
    unit = np.repeat([1.0, coarse.mean_motion], 3)
    enough = max(RECOVERED * float(np.abs(error / unit).max()), SMALL)
    limit, state, saturated, index = np.array(coarse.thrust_limit), error, 0, 0
    nowhere = np.empty((0, 6))
    for index in range(1, max(1, int(duration / tick)) + 1):
        time = (index - 1) * tick
        elements = replace(coarse.chief_elements, true_anomaly=ellipse.anomaly(time))
        seen = NavigationState(coarse.tick_ns * (index - 1), state, state_from_elements(elements), parameters.mass)
        thrust, status = manager.on_tick(seen, Target(seen.time, "", np.zeros(6), coarse.tick_ns, nowhere))
        phi, gamma = steady or model.discretise(time, tick)
        state = phi @ state + gamma @ thrust.force / parameters.mass
        saturated += bool((np.abs(thrust.force) >= FULL * limit)[limit > 0.0].any())
        # A plan that a law accepts is within the limit and ends at the target.
        if status.solver == PLANNED or np.abs(state / unit).max() <= enough:
            return Forecast(index * tick, float(np.linalg.norm(state[:3])), saturated / index)
    return Forecast(np.inf, float(np.linalg.norm(state[:3])), saturated / index)


def _tick(parameters: ControllerParameters) -> float:
    """The step of an MPC's plan; else a round number of the flight's ticks, `POINTS` or more per revolution."""
    law = parameters.laws[parameters.algorithm]
    if isinstance(law, MpcParameters):
        return law.step
    most = tau / parameters.mean_motion / POINTS / parameters.tick
    counts = [step * 10**power for power in range(7) for step in (1, 2, 5) if step * 10**power <= most]
    return parameters.tick * max(counts, default=1)


def recovery_warnings(scenario: Scenario) -> list[str]:
    """A line for each deputy whose law does not take back the error at the start."""
    warnings = []
    for deputy, error in initial_errors(scenario).items():
        parameters = scenario.deputies[deputy]["controller"]
        words = "" if parameters.algorithm == "coast" else _lost(parameters, error)
        if words:
            distance = float(np.linalg.norm(error[:3]))
            warnings.append(
                f"/{deputy}/controller: {parameters.algorithm} is not expected to take back the {distance:.0f} m "
                f"to the target at the start: {words}"
            )
    return warnings


def _lost(parameters: ControllerParameters, error: Vector) -> str:
    """What is wrong with a recovery, and what would do; empty if nothing is."""
    revolution = tau / parameters.mean_motion
    given = REVOLUTIONS * revolution + float(getattr(parameters.laws[parameters.algorithm], "final_time", 0.0))
    if isfinite(forecast(parameters, error, given).time):
        return ""
    limit = np.array(parameters.thrust_limit) / parameters.mass
    least = shortest_time(error, limit, parameters.mean_motion)
    if not isfinite(least):
        return f"it is out of reach of {list(parameters.thrust_limit)} N; more thrust or a closer start would do"
    longest = max(given, PATIENCE * least)
    outcome = forecast(parameters, error, longest)
    if isfinite(outcome.time):
        return ""
    spent = float(delta_v(error, PATIENCE * least, parameters.mean_motion))
    reach = f"the least time is {least / 60.0:.0f} min, and in {PATIENCE:g} times it {spent:.2g} m/s would do"
    words = f"{outcome.distance:.0f} m off after {longest / revolution:.1f} revolutions, "
    words += f"at the thrust limit in {outcome.saturated:.0%} of the ticks; {reach}"
    other = forecast(replace(parameters, algorithm=REMEDY), error, longest)
    if parameters.algorithm != REMEDY and isfinite(other.time):
        return f"{words}; {REMEDY} takes {other.time / 60.0:.0f} min"
    return f"{words}; more thrust or a closer start would do"
