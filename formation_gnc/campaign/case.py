"""A case: a pure function of the campaign, its number and the configuration, from the file to a row of figures."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from formation_gnc.campaign.definition import Campaign, Configuration
from formation_gnc.campaign.dispersion import Address, Dispersion, flat, stream
from formation_gnc.campaign.flight_figures import FlightRecord
from formation_gnc.errors import ConfigurationError, nearest
from formation_gnc.flight.graph import PLANT
from formation_gnc.guidance.fleet_checks import check_fleet
from formation_gnc.parameters import Leaf, dump, leaves, load
from formation_gnc.sil.following import SHARED
from formation_gnc.sil.overrides import address_of
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import Scenario, load_scenario, matches
from formation_gnc.types import Matrix

CASE, VARIANT, REASON = "case", "variant", "reason"

SEED_RANGE = 2**53
"""Seeds of cases are below it: exact in every number format."""


@dataclass(frozen=True)
class FlownCase:
    """A case as flown in one configuration: its row, and errors over time by deputy; none if it raised."""

    row: Mapping[str, Any]
    curves: Mapping[str, Matrix]


def seed_of(campaign: Campaign, case: int) -> int:
    """Seed of the run of a case, the same in all configurations."""
    return int(stream(campaign.seed, case, "seed").integers(SEED_RANGE))


@lru_cache(maxsize=64)
def _nominal(configuration: Configuration) -> Scenario:
    return load_scenario(str(configuration.scenario), configuration.overrides)


def nominal_scenario(campaign: Campaign, configuration: Configuration) -> Scenario:
    """Scenario of a configuration before anything is drawn.

    Raises:
        ConfigurationError: the configuration cannot be flown.
    """
    try:
        return _nominal(configuration)
    except ConfigurationError as error:
        raise ConfigurationError(f"{configuration.name}: {error}") from None


def addresses(dispersion: Dispersion, scenario: Scenario) -> Iterator[tuple[Address, Leaf, Any]]:
    """Parameters of a scenario that a dispersion means, with schema and value.

    Raises:
        ConfigurationError: no node has it.
    """
    source = f"dispersion {dispersion.name}"
    pattern, name = address_of(dispersion.name, source)
    nodes = _nodes(scenario)
    meant = [node for node in nodes if (node == PLANT if pattern == "/**" else matches(pattern, node))]
    if not meant:
        raise ConfigurationError(f"{source}: no such node; the run has {', '.join(nodes)}")
    for node in meant:
        values = dump(nodes[node])
        known = {leaf.name: leaf for leaf in leaves(type(nodes[node]), values)}
        if name not in known:
            raise ConfigurationError(f"{source}: unknown parameter {name} of {node}; {nearest(name, known)}")
        yield (node, name), known[name], values[name]


def _nodes(scenario: Scenario) -> dict[str, Any]:
    modules = {f"/{deputy}/{name}": each for deputy, own in scenario.deputies.items() for name, each in own.items()}
    return {PLANT: scenario.plant, **modules}


def check_dispersions(campaign: Campaign, configuration: Configuration) -> None:
    """Raise ConfigurationError for a dispersion of no parameter, or one that leaves a parameter's range."""
    scenario = nominal_scenario(campaign, configuration)
    for dispersion in campaign.dispersions:
        for _, leaf, base in addresses(dispersion, scenario):
            dispersion.check(leaf, base)


def draw(campaign: Campaign, case: int, scenario: Scenario) -> dict[str, dict[Address, Any]]:
    """Values of the dispersed parameters of a case, by name of the dispersion, on a nominal scenario."""
    return {
        each.name: {address: each.value(campaign.seed, case, base) for address, _, base in addresses(each, scenario)}
        for each in campaign.dispersions
    }


def fault_entries(campaign: Campaign, case: int) -> dict[str, str]:
    """Entries of the faults that happen in a case, by their names in the file."""
    entries = {each.name: each.entry(campaign.seed, case) for each in campaign.faults}
    return {name: entry for name, entry in entries.items() if entry is not None}


def with_values(
    campaign: Campaign,
    configuration: Configuration,
    drawn: Mapping[str, Mapping[Address, Any]],
    faults: Mapping[str, str],
    seed: int,
) -> Scenario:
    """Scenario of a configuration with drawn values.

    What is drawn for the plant is the plant's alone: flight software keeps what the scenario tells it. Only what all
    nodes share (the chief's orbit at the start, tick, epoch) is drawn for all.
    """
    values = {address: value for each in drawn.values() for address, value in each.items()}
    shared = {name: value for (node, name), value in values.items() if node == PLANT and name in SHARED}
    scenario = nominal_scenario(campaign, configuration)
    if shared:
        given = {**configuration.overrides, "/**": {**configuration.overrides.get("/**", {}), **shared}}
        scenario = load_scenario(str(configuration.scenario), given)

    def own(node: str) -> dict[str, Any]:
        return {name: value for (place, name), value in values.items() if place == node and name not in shared}

    plant = {**dump(scenario.plant), **own(PLANT), "seed": seed}
    plant["faults"] = [*plant["faults"], *faults.values()]
    deputies = {
        deputy: {
            name: load(type(each), dump(each) | own(f"/{deputy}/{name}")) if own(f"/{deputy}/{name}") else each
            for name, each in modules.items()
        }
        for deputy, modules in scenario.deputies.items()
    }
    check_fleet({deputy: each["guidance"] for deputy, each in deputies.items()})
    return replace(scenario, plant=load(type(scenario.plant), plant), deputies=deputies)


def scenario_of(campaign: Campaign, case: int, configuration: Configuration) -> Scenario:
    """Scenario of a case, every parameter resolved; raises ConfigurationError for what is not allowed."""
    drawn = draw(campaign, case, nominal_scenario(campaign, configuration))
    return with_values(campaign, configuration, drawn, fault_entries(campaign, case), seed_of(campaign, case))


def drawn_columns(campaign: Campaign, case: int, scenario: Scenario | None) -> dict[str, Any]:
    """Columns of the drawn values as they stand in the scenario of a case; of a fault that does not happen, None."""
    columns: dict[str, Any] = {}
    nodes = {} if scenario is None else {node: dump(each) for node, each in _nodes(scenario).items()}
    for each in campaign.dispersions:
        if scenario is not None:
            (node, name), *_ = (address for address, _, _ in addresses(each, scenario))
            columns |= flat(each.name, nodes[node][name])
    entries = {} if scenario is None else fault_entries(campaign, case)
    planned = () if scenario is None else scenario.plant.planned_faults
    injected = dict(zip(entries, planned[len(planned) - len(entries) :], strict=True))
    for fault in campaign.faults:
        name = f"faults.{fault.name}"
        if fault.probability < 1.0:
            columns[name] = fault.name in injected
        for field in fault.drawn:
            count = fault.count(field)
            value = getattr(injected[fault.name].fault, field) if fault.name in injected else None
            absent = (None,) * count if count else None
            columns |= flat(f"{name}.{field}", absent if value is None else value)
    return columns


def fly_case(campaign: Campaign, case: int, configuration: Configuration) -> FlownCase:
    """Fly a case in-process.

    A case that raises, whatever it is, is a row with its reason and no figures.
    """
    row: dict[str, Any] = {CASE: case, VARIANT: configuration.name, "seed": seed_of(campaign, case), REASON: ""}
    curves: dict[str, Matrix] = {}
    scenario: Scenario | None = None
    try:
        scenario = scenario_of(campaign, case, configuration)
        plant = scenario.plant
        record = FlightRecord(plant.deputies, plant.ticks, plant.tick)
        Run(scenario).fly(record)
        figures, curves = record.figures(campaign.within), record.curves()
    except Exception as error:
        figures = {}
        row[REASON] = f"{type(error).__name__}: {' '.join(str(error).split())}"
    return FlownCase(row | drawn_columns(campaign, case, scenario) | figures, curves)
