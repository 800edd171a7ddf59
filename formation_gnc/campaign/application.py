"""Proof that every dispersion is applied: before the flights by parameters and by flying, afterwards by the data set.

Two draws of a dispersion, all else alike, must give different parameters and different flights. A dispersion of a
parameter that no configuration uses is refused, whatever it was meant to do.
"""

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from itertools import islice
from typing import Any

import numpy as np

from formation_gnc.campaign.case import (
    addresses,
    check_dispersions,
    draw,
    fault_entries,
    nominal_scenario,
    scenario_of,
    seed_of,
    with_values,
)
from formation_gnc.campaign.definition import Campaign, Configuration
from formation_gnc.errors import ConfigurationError
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import Scenario

LOOKED_AT = 256
"""Cases among which two different draws are looked for, at most."""

PAIRS = 2
"""Pairs of cases that are flown before a dispersion counts as one that changes nothing."""


def check_application(campaign: Campaign, say: Callable[[str], None]) -> None:
    """Check that every dispersion changes what is flown, and that every configuration flies at all.

    Args:
        campaign: to check.
        say: takes a line about each dispersion that is checked.

    Raises:
        ConfigurationError: a dispersion or a fault that changes nothing, leaves a range or names no parameter, or a
            configuration that cannot be flown.
    """
    for configuration in campaign.configurations:
        check_dispersions(campaign, configuration)
        Run(scenario_of(campaign, 0, configuration))
    _check_configurations(campaign)
    if campaign.runs < 2:
        return
    for name in (each.name for each in campaign.dispersions):
        say(f"checking dispersion {name}")
        _check(campaign, f"dispersion {name}", name, "")
    for fault in campaign.faults:
        say(f"checking fault {fault.name}")
        _check(campaign, f"fault {fault.name}", "", fault.name)


def _check_configurations(campaign: Campaign) -> None:
    """Raise ConfigurationError for two configurations of the same parameters."""
    seen: dict[str, str] = {}
    for configuration in campaign.configurations:
        resolved = repr(sorted(scenario_of(campaign, 0, configuration).parameters().items()))
        if resolved in seen:
            raise ConfigurationError(f"{configuration.name}: flies the same as {seen[resolved]}; nothing differs")
        seen[resolved] = configuration.name


def _check(campaign: Campaign, words: str, dispersion: str, fault: str) -> None:
    """Check one dispersion or one fault."""
    pairs = list(islice(_pairs(campaign, dispersion, fault), PAIRS))
    if not pairs:
        cases = min(campaign.runs, LOOKED_AT)
        raise ConfigurationError(f"{words}: draws the same in all of {cases} cases; give it a width, or more runs")
    for configuration in campaign.configurations:
        for one, other in pairs:
            both = [_varied(campaign, configuration, case, dispersion, fault) for case in (one, other)]
            if both[0].parameters() == both[1].parameters():
                raise ConfigurationError(
                    f"{words}: changes nothing; {configuration.name} has the same parameters in cases {one} and {other}"
                )
    for configuration in campaign.configurations:
        for one, other in pairs:
            both = [_varied(campaign, configuration, case, dispersion, fault) for case in (one, other)]
            if _fly_differently(*both):
                return
    raise ConfigurationError(
        f"{words}: changes nothing; flights that differ in it alone, as cases {pairs[0][0]} and {pairs[0][1]} do, have "
        "the same bits to the end"
    )


def _pairs(campaign: Campaign, dispersion: str, fault: str) -> Iterator[tuple[int, int]]:
    """Pairs of cases with different draws, those furthest apart first."""
    cases = range(min(campaign.runs, LOOKED_AT))
    if dispersion:
        meant = next(each for each in campaign.dispersions if each.name == dispersion)
        scenario = nominal_scenario(campaign, campaign.configurations[0])
        _, _, base = next(addresses(meant, scenario))
        values = {case: meant.value(campaign.seed, case, base) for case in cases}
    else:
        values = {case: fault_entries(campaign, case).get(fault, "") for case in cases}
    order = sorted(values, key=lambda case: (repr(type(values[case])), values[case]))
    for one, other in zip(order, reversed(order), strict=True):
        if values[one] == values[other]:
            return
        yield one, other


def _varied(campaign: Campaign, configuration: Configuration, case: int, dispersion: str, fault: str) -> Scenario:
    """Scenario of case 0 with one dispersion, or one fault, drawn as in another case."""
    scenario = nominal_scenario(campaign, configuration)
    drawn, faults = draw(campaign, 0, scenario), fault_entries(campaign, 0)
    if dispersion:
        drawn[dispersion] = draw(campaign, case, scenario)[dispersion]
    else:
        entry = fault_entries(campaign, case).get(fault)
        faults = {name: each for name, each in faults.items() if name != fault} | ({fault: entry} if entry else {})
    return with_values(campaign, configuration, drawn, faults, seed_of(campaign, 0))


def _fly_differently(one: Scenario, other: Scenario) -> bool:
    """Whether two flights differ in any record of any tick; they end where they do, or where one of them raises."""
    runs = [Run(one), Run(other)]
    while not runs[0].plant.finished and not runs[1].plant.finished:
        records: list[dict[str, Any]] = [{}, {}]
        for run, sink in zip(runs, records, strict=True):
            try:
                run.tick(sink.__setitem__)
            except Exception:
                return True  # to be a row with its reason, which is no matter of this check
        if not _same(*records):
            return True
    return runs[0].plant.finished != runs[1].plant.finished


def _same(one: Any, other: Any) -> bool:
    """Whether two records, or parts of them, have the same bits."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other, equal_nan=True)
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(_same(value, other[key]) for key, value in one.items())
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(_same, one, other))
    if is_dataclass(one):
        return all(_same(getattr(one, each.name), getattr(other, each.name)) for each in fields(one))
    return bool(one == other or one != one)
