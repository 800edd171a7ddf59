"""Parameters that a node is given on its command line: by `-p`, and in parameter files."""

import difflib
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from formation_gnc.flight.graph import GRAPH
from formation_gnc.parameters import leaves, read_yaml
from formation_gnc.plant.parameters import PlantParameters
from formation_gnc.recording.parameters import RecorderParameters
from formation_gnc.recording.player import ReplayParameters
from formation_gnc.sil.scenario import matches, sections_given_to

ALL_NODES = "/**"
OPTION = "-p"
NEAR = 0.8
"""Similarity from which an unknown name is taken for a misspelt one."""


@dataclass
class GivenParameters:
    """Values by dotted name, the last one given of each, and where it came from."""

    values: dict[str, Any] = field(default_factory=dict)
    sources: dict[str, str] = field(default_factory=dict)
    """`/**` of a file, `-p` for all nodes of a process, or the pattern of nodes that it is addressed to."""

    def add(self, source: str, values: dict[str, Any]) -> None:
        """Add values of one source, over those there are."""
        self.values |= values
        self.sources |= dict.fromkeys(values, source)

    def take(self, prefixes: tuple[str, ...]) -> dict[str, Any]:
        """Take out the values whose names begin with one of these."""
        names = [name for name in self.values if name.startswith(prefixes)]
        for name in names:
            del self.sources[name]
        return {name: self.values.pop(name) for name in names}

    def drop_foreign(self, schema: Any) -> dict[str, str]:
        """Drop what is given to all nodes and is another one's; returns the sources of what is dropped, by name.

        What is addressed to the node stays, and so does an option `-p` that looks like a misspelt parameter of it.
        """
        known = {leaf.name for leaf in leaves(schema, self.values)}
        dropped = {name: source for name, source in self.sources.items() if self._is_foreign(name, source, known)}
        for name in dropped:
            del self.values[name], self.sources[name]
        return dropped

    def _is_foreign(self, name: str, source: str, known: set[str]) -> bool:
        if name in known or source not in (ALL_NODES, OPTION):
            return False
        is_near = difflib.get_close_matches(name, known, n=1, cutoff=NEAR)
        return source == ALL_NODES or not is_near or name in self._known_to_others()

    def _known_to_others(self) -> set[str]:
        from formation_gnc.transport.markers import DisplayParameters  # heavy, and seldom needed

        schemas = (PlantParameters, RecorderParameters, ReplayParameters, DisplayParameters)
        rows = (row.parameters for row in GRAPH)
        return {leaf.name for schema in (*schemas, *rows) for leaf in leaves(schema, self.values)}


def given_parameters(arguments: Sequence[str], names: Collection[str]) -> GivenParameters:
    """What a command line gives the node of these full names: its own, and the one within its formation.

    Options `-p` go over files, whatever the order; in files the sections of one pattern count as one, where it
    appears first, as rcl has it.

    Raises:
        ConfigurationError: a file cannot be read, or is no ROS 2 parameter file.
    """
    sections: dict[str, dict[str, Any]] = {}
    options = GivenParameters()
    for flag, value in _options(arguments):
        if flag == "--params-file":
            for pattern, values in sections_given_to(Path(value), names):
                sections.setdefault(f"/{pattern.lstrip('/')}", {}).update(values)
        else:
            rule, _, text = value.partition(":=")
            pattern, _, name = rule.rpartition(":")
            if not pattern or any(matches(pattern, node) for node in names):
                options.add(pattern or OPTION, {name: read_yaml(text)})
    given = GivenParameters()
    for pattern, values in sections.items():
        given.add(pattern, values)
    for name, value in options.values.items():
        given.add(options.sources[name], {name: value})
    return given


def without_parameters(arguments: Sequence[str]) -> list[str]:
    """A command line without the parameters on it."""
    left, each = list[str](), iter(arguments)
    for argument, is_option in _marked(each):
        if is_option:
            next(each, None)
        else:
            left.append(argument)
    return left


def _options(arguments: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Options that give parameters, with their values; `-p` by that name."""
    each = iter(arguments)
    for argument, is_option in _marked(each):
        if is_option and (value := next(each, None)) is not None:
            yield "-p" if argument == "--param" else argument, value


def _marked(arguments: Iterator[str]) -> Iterator[tuple[str, bool]]:
    """Arguments, and whether each is an option of ROS that gives parameters and is followed by its value."""
    is_for_ros = False
    for argument in arguments:
        is_for_ros = argument == "--ros-args" or (is_for_ros and argument != "--")
        yield argument, is_for_ros and argument in ("-p", "--param", "--params-file")
