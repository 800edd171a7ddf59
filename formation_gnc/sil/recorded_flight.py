"""A flight in this process, recorded as the recorder node would record the node graph."""

from collections.abc import Callable
from pathlib import Path

from formation_gnc.errors import ConfigurationError
from formation_gnc.parameters import to_json
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.layout import LAYOUT, foxglove_layout
from formation_gnc.recording.provenance import parameters_record, provenance
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import Scenario

SHOWN = 500
"""Ticks between two calls of `show`."""


def fly(scenario: Scenario, bag: str | Path, show: Callable[[int], None] = lambda tick: None) -> Bag:
    """Fly a scenario to its end in this process; the bag has the bits of a flight on the node graph.

    Args:
        scenario: what flies.
        bag: directory to make for the bag.
        show: called before the first tick and every `SHOWN` with the number of ticks flown.

    Returns:
        The closed bag.

    Raises:
        ConfigurationError: the scenario cannot be flown in-process, or the directory exists.
    """
    if scenario.plant.real_time_factor:
        raise ConfigurationError("real_time_factor: has no effect in-process; fly the node graph for a paced run")
    run = Run(scenario)
    parameters = {
        parameters_record(node): {name: to_json(value) for name, value in values.items()}
        for node, values in scenario.parameters().items()
    }
    origin = {"run": {"scenario": scenario.name, "seed": str(scenario.plant.seed)}}
    files = {f"{scenario.name}.yaml": scenario.text(), LAYOUT: foxglove_layout(scenario.plant.deputies)}
    attachments = {name: text.encode() for name, text in files.items()}
    with BagWriter(Path(bag), provenance() | origin | parameters, attachments) as writer:
        sink = InProcessRecorder(writer)
        while not run.plant.finished:
            if run.plant.tick % SHOWN == 0:
                show(run.plant.tick)
            run.tick(sink)
    return Bag(bag)
