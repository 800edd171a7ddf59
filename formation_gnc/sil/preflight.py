"""What an engineer would say of a scenario before it flies: warnings, and notes on what is a matter of choice."""

from collections import defaultdict
from itertools import combinations
from math import tau

import numpy as np

from formation_gnc.errors import ConfigurationError
from formation_gnc.guidance.slots import design_path
from formation_gnc.navigation.observability import gramian, in_words, orbit_period, unobservable_directions
from formation_gnc.navigation.parameters import NavigationParameters
from formation_gnc.orbit.elements import state_from_elements
from formation_gnc.plant.plant import Plant
from formation_gnc.sil.path_demand import path_demand_warnings
from formation_gnc.sil.process_noise import process_noise_warnings
from formation_gnc.sil.recovery_forecast import recovery_warnings
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import Scenario
from formation_gnc.types import Vector

LOOKS = 360
"""Points of a revolution at which target paths are compared."""

SAMPLES_PER_RADIAN = 10.0
"""Ticks that the fastest closed-loop pole should have in one over its frequency: a tenth of a radian a tick costs 3
degrees of phase."""

NEGLIGIBLE = 0.01
"""Separation across the flight direction, as a share of the least separation, that is none."""


def warnings(scenario: Scenario) -> list[str]:
    """A line for each thing that will not fly as it is probably meant.

    Raises:
        ConfigurationError: the scenario cannot be flown at all.
    """
    Plant(scenario.plant)  # rejects what cannot be flown, before any warning
    return [
        *(f"parameter {name}, given to all nodes: ignored, since none has it" for name in scenario.ignored),
        *scenario.departures(),
        *process_noise_warnings(scenario),
        *path_demand_warnings(scenario),
        *recovery_warnings(scenario),
    ]


def notes(scenario: Scenario) -> list[str]:
    """A line for each weakness that a design may well have: blind directions, slow sampling, no passive safety.

    Raises:
        ConfigurationError: the scenario cannot be flown at all.
    """
    Run(scenario)
    return [*_blind(scenario), *_slowly_sampled(scenario), *_not_passively_safe(scenario)]


def _blind(scenario: Scenario) -> list[str]:
    found = defaultdict[str, list[str]](list)
    chief = state_from_elements(scenario.plant.chief_elements)
    for name, modules in scenario.deputies.items():
        parameters: NavigationParameters = modules["navigation"]
        variance = {sensor: tuple(each**2 for each in sigma) for sensor, sigma in parameters.sigmas.items()}
        window = parameters.observability_window or orbit_period(chief)
        start = np.array(scenario.plant.deputy[name].relative_state)
        if words := in_words(unobservable_directions(gramian(chief, variance, window, start), parameters.mean_motion)):
            found[f"{', '.join(variance)} leave a direction unobserved, mostly {words}"].append(name)
    return [f"navigation of {', '.join(names)}: {what}" for what, names in found.items()]


def _slowly_sampled(scenario: Scenario) -> list[str]:
    from formation_gnc.analysis.design_report import design

    found = defaultdict[str, list[str]](list)
    for name, modules in scenario.deputies.items():
        try:
            fastest = float(np.abs(design(modules["controller"]).poles).max(initial=0.0))
        except ConfigurationError:
            continue  # no linear form to report
        tick = scenario.plant.tick
        if fastest * tick * SAMPLES_PER_RADIAN > 1.0:
            what = f"tick {tick:g} s is slow for its fastest pole, {fastest:.3g} rad/s; at most "
            found[f"{what}{1.0 / fastest / SAMPLES_PER_RADIAN:.3g} s"].append(name)
    return [f"controller of {', '.join(names)}: {what}" for what, names in found.items()]


def _not_passively_safe(scenario: Scenario) -> list[str]:
    """Pairs whose targets come close across the flight direction, where a drift along it leads to a collision."""
    times = np.linspace(0.0, tau / scenario.plant.mean_motion, LOOKS)
    paths = {"chief": np.zeros((LOOKS, 6))}
    limits = {}
    for name, modules in scenario.deputies.items():
        paths[name] = design_path(modules["guidance"]).states(times)
        limits[name] = modules["guidance"].separation_warning
    found = []
    for (one, path), (other, another) in combinations(paths.items(), 2):
        offset = path[:, :3] - another[:, :3]
        across, nearest = _least_across(offset), float(np.linalg.norm(offset, axis=1).min())
        if across < max(limits.get(one, 0.0), limits.get(other, 0.0), NEGLIGIBLE * nearest):
            found.append(f"{one} and {other} ({across:.1f} m)")
    if not found:
        return []
    return [f"targets close across the flight direction, where a drift along it may collide: {', '.join(found)}"]


def _least_across(offset: Vector) -> float:
    """Least distance in the plane of radius and orbit normal of offsets (N, 3), m."""
    return float(np.hypot(offset[:, 0], offset[:, 2]).min())
