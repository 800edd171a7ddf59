"""Replays a bag into a new one."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from formation_gnc.flight import topics
from formation_gnc.flight.graph import MODULES
from formation_gnc.parameters import to_json
from formation_gnc.recording.in_process_recorder import InProcessRecorder, reader
from formation_gnc.recording.provenance import parameters_record, provenance
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.replay import has_flown, nodes_of, parameters_of, replay
from formation_gnc.sil.scenario import given_to


def replay_into(bag: Bag, output: Path, modules: Sequence[str] | None, parameter_file: Path | None) -> list[str]:
    """Replay the named modules of every deputy of a bag, and record the new run.

    Args:
        bag: the recorded run.
        output: directory to make for the new bag.
        modules: names of rows of the graph table; None for all those that flew, by the bag's parameters and outputs.
        parameter_file: ROS 2 parameter file whose values override the recorded ones; None for none.

    Returns:
        What could not be replayed as it was, in words.

    Raises:
        ConfigurationError: no such module, parameters that cannot be flown, or a directory that exists.
    """
    parameters: dict[str, Mapping[str, Any]] = {}
    remarks = []
    deputies = topics.deputies_in(bag.topics)
    for node in nodes_of(bag, list(MODULES) if modules is None else modules):
        changes = given_to(parameter_file, node, deputies) if parameter_file else {}
        values = parameters_of(bag, node) | changes
        if modules is None and not values and not has_flown(bag, node):
            remarks.append(f"{node} is left out: the bag has neither parameters nor records of it")
            continue
        parameters[node] = values
    flown = {
        parameters_record(node): {name: to_json(value) for name, value in values.items()}
        for node, values in parameters.items()
    }
    origin = {"replay": {"source": bag.path.absolute().name, "nodes": ", ".join(parameters)}}
    with BagWriter(output, bag.metadata | provenance() | flown | origin, bag.attachments) as writer:
        recorder = InProcessRecorder(writer)
        return remarks + replay(
            bag,
            parameters,
            reader(bag),
            recorder,
            lambda topic, data, stamp: recorder.copy(bag, topic, data, stamp),
        )
