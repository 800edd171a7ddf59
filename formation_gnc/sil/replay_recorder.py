"""Replays a bag into a new one."""

from collections.abc import Sequence
from pathlib import Path

from formation_gnc.flight import topics
from formation_gnc.flight.graph import MODULES
from formation_gnc.parameters import to_json
from formation_gnc.recording.in_process_recorder import InProcessRecorder, reader
from formation_gnc.recording.provenance import parameters_record, provenance
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.replay import has_flown, replay
from formation_gnc.sil.scenario import given_to
from formation_gnc.sil.starts import nodes_of, starts_of


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
    deputies, read = topics.deputies_in(bag.topics), reader(bag)
    nodes = nodes_of(bag, list(MODULES) if modules is None else modules)
    overrides = {node: given_to(parameter_file, node, deputies) for node in nodes} if parameter_file else {}
    starts, remarks = starts_of(bag, nodes, read, overrides), []
    for node in nodes:
        if modules is None and not starts[node][0].values and not has_flown(bag, node):
            remarks.append(f"{node} is left out: the bag has neither parameters nor records of it")
            del starts[node]
    flown = {
        parameters_record(node, start.answer): {name: to_json(value) for name, value in start.values.items()}
        for node, own in starts.items()
        for start in own
        if start.values
    }
    origin = {"replay": {"source": bag.path.absolute().name, "nodes": ", ".join(starts)}}
    with BagWriter(output, bag.metadata | provenance() | flown | origin, bag.attachments) as writer:
        recorder = InProcessRecorder(writer)
        return remarks + replay(
            bag,
            starts,
            read,
            recorder,
            lambda topic, data, stamp: recorder.copy(bag, topic, data, stamp),
        )
