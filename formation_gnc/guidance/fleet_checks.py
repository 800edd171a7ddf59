"""Checks of a fleet's guidance parameters against one another, before the run."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations

import numpy as np

from formation_gnc.errors import ConfigurationError
from formation_gnc.guidance.guidance import Guidance
from formation_gnc.guidance.parameters import GuidanceParameters
from formation_gnc.types import NANOSECONDS


def check_fleet(deputies: Mapping[str, GuidanceParameters]) -> None:
    """Check that fleets are complete and of one mind, and that no two deputies share a slot at any scheduled time.

    Args:
        deputies: guidance parameters by deputy.

    Raises:
        ConfigurationError: a fleet has a satellite that does not fly, differing parameters where slots are
            assigned, or two deputies with one target.
    """
    for name, parameters in deputies.items():
        _check_members(name, parameters, deputies)
    _check_slots({name: each for name, each in deputies.items() if each.assignment == "fixed"})


def _check_members(name: str, parameters: GuidanceParameters, deputies: Mapping[str, GuidanceParameters]) -> None:
    strangers = [each for each in parameters.fleet if each not in deputies]
    if strangers:
        raise ConfigurationError(f"{name}: fleet has {', '.join(strangers)}, who must be one of the deputies")
    if parameters.assignment == "fixed":
        return
    for member in parameters.fleet:
        if replace(deputies[member], slot=0, phase=0.0) != replace(parameters, slot=0, phase=0.0):
            raise ConfigurationError(
                f"{name} and {member}: their slots are assigned together, so that their guidance parameters "
                "must be the same but for slot and phase"
            )


def _check_slots(deputies: Mapping[str, GuidanceParameters]) -> None:
    """Reject two deputies with one target at the start or at any scheduled change."""
    guidances = {name: Guidance(f"/{name}/guidance", parameters) for name, parameters in deputies.items()}
    for time in sorted({0, *(at for guidance in guidances.values() for at, _ in guidance.pending)}):
        states = {}
        for name, guidance in guidances.items():
            guidance.begin_tick(time)
            states[name] = guidance.configuration.design.states(np.array([time / NANOSECONDS]))[0]
        for one, other in combinations(guidances, 2):
            if np.linalg.norm((states[one] - states[other])[:3]) < 1e-3 and np.allclose(
                states[one][3:], states[other][3:], rtol=0.0, atol=1e-6
            ):
                parameters = guidances[one].parameters
                raise ConfigurationError(
                    f"{one} and {other} are in one slot from {time / NANOSECONDS:g} s: "
                    f"{parameters.formation}, slot {parameters.slot}; each must have its own"
                )
