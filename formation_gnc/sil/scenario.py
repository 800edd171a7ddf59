"""One scenario file per run: a standard ROS 2 parameter file, read as every node would read it."""

import difflib
import math
import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.graph import DISPLAY, GRAPH, MODULES, PLANT, RECORDER
from formation_gnc.limited_yaml import RejectedYamlError
from formation_gnc.parameters import OWN_OF_ROS, dump, leaves, load, read_yaml
from formation_gnc.plain_file import read_plain
from formation_gnc.plant.parameters import PlantParameters
from formation_gnc.shipped import find_shipped
from formation_gnc.sil.following import SHARED, departures, with_followed

SECTION = "ros__parameters"

ALL = "**"
"""Pattern of all nodes: what it gives a node that has no such parameter is another's, as every node has it."""

EXTENDS = "extends"
"""Key of the scenario that a file extends: its sections come first, and what the file gives goes before them."""

RUN_NODES = (PLANT, RECORDER, DISPLAY, "/replay")
"""Nodes that are one per run, some only when asked."""

DEFAULT_DEPUTIES = next(each.default for each in fields(PlantParameters) if each.name == "deputies")

MOST_NAMED = 12
"""Nodes that an error names at most."""

NODE = re.compile(r"/?([A-Za-z0-9_]+|\*\*?)(/([A-Za-z0-9_]+|\*\*?))*")
"""Names of nodes and patterns of them that ROS takes in a parameter file."""


type Sections = list[tuple[str, Mapping[str, Any]]]
"""Patterns of nodes with values by dotted name, in the order in which they are given."""


@dataclass(frozen=True)
class Scenario:
    """A run, ready to fly: every parameter of every node, checked."""

    name: str
    plant: PlantParameters
    deputies: Mapping[str, Mapping[str, Any]]
    """Parameters of every deputy's modules, by deputy and module."""
    others: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """What the run's other nodes are given, by full name, unchecked; what all share is the plant's."""
    ignored: tuple[str, ...] = ()
    """Parameters that the file gives all nodes and none of these has."""

    def parameters(self) -> dict[str, dict[str, Any]]:
        """All parameters by full node name, then by dotted name."""
        nodes: dict[str, Any] = {PLANT: self.plant}
        for name, modules in self.deputies.items():
            nodes |= {f"/{name}/{module}": values for module, values in modules.items()}
        return {node: dump(values) for node, values in nodes.items()}

    def departures(self) -> list[str]:
        """A line for each node with parameters that differ from the plant's, which they follow by default."""
        plant = dump(self.plant)
        found = {
            f"/{deputy}/{module}": departures(values, plant, deputy)
            for deputy, modules in self.deputies.items()
            for module, values in modules.items()
        }
        return [f"{node}: {'; '.join(words)}" for node, words in found.items() if words]

    def text(self, extra: Mapping[str, Mapping[str, Any]] | None = None) -> str:
        """The scenario as a ROS 2 parameter file, nothing left to defaults and `extra` on top of it."""
        nodes = self.parameters() | {node: dict(values) for node, values in self.others.items()}
        for node, values in (extra or {}).items():
            nodes[node] = nodes.get(node, {}) | dict(values)
        document = {
            # rclpy takes an empty list for a parameter without a type: left out, it is the default
            node: {SECTION: {name: _plain(value) for name, value in values.items() if value != ()}}
            for node, values in nodes.items()
        }
        return str(yaml.safe_dump(document, sort_keys=False))


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def load_scenario(name: str, overrides: Mapping[str, Mapping[str, Any]] | None = None) -> Scenario:
    """Read and check a scenario; what modules are not given is as the plant has it.

    Args:
        name: of a scenario in `params/`, or the path of a parameter file.
        overrides: parameters that go before the file's, by node pattern such as ``/**/controller``.

    Raises:
        ConfigurationError: no such scenario, an unreadable file, a section or override of no node, or a parameter
            that is not allowed.
    """
    from formation_gnc.guidance.fleet_checks import check_fleet  # nodes that only read their section need no guidance

    path = find_scenario(name)
    written = _sections(path)
    given_to_all = {name for pattern, section in written if pattern.strip("/") == ALL for name in section}
    # What is given on top is meant for every node that it is given to.
    on_top = [
        (f"/{ALL}/*" if pattern.strip("/") == ALL else pattern, values) for pattern, values in (overrides or {}).items()
    ]
    sections = [*written, *on_top]
    listed = _given(sections, PLANT).get("deputies", DEFAULT_DEPUTIES)
    deputies = listed if isinstance(listed, list | tuple) else ()
    _check_sections(str(path), written, deputies, RUN_NODES)
    _check_sections(f"{path.name}: overrides", on_top, deputies, (PLANT,))
    try:
        plant = _load(PlantParameters, _given(sections, PLANT, PlantParameters), PLANT)
        modules = {deputy: _load_modules(sections, dump(plant), deputy) for deputy in plant.deputies}
        check_fleet({deputy: each["guidance"] for deputy, each in modules.items()})
    except ConfigurationError as error:
        raise ConfigurationError(f"{path.name}: {error}") from None
    ignored = given_to_all.difference(
        *(dump(each) for each in (plant, *(module for own in modules.values() for module in own.values())))
    )
    addressed = [(pattern, values) for pattern, values in sections if pattern.strip("/") != ALL]
    others = {node: _given(addressed, node) for node in RUN_NODES if node != PLANT}
    own = {node: {name: each for name, each in values.items() if name not in SHARED} for node, values in others.items()}
    return Scenario(
        path.stem,
        plant,
        modules,
        {node: values for node, values in own.items() if values},
        tuple(sorted(name for name in ignored if not _is_of_ros(name))),
    )


def _load_modules(sections: Sections, plant: Mapping[str, Any], deputy: str) -> dict[str, Any]:
    """Parameters of a deputy's modules, by module."""
    loaded = {}
    for row in GRAPH:
        node = f"/{deputy}/{row.name}"
        given = _given(sections, node, row.parameters)
        loaded[row.name] = _load(row.parameters, with_followed(row.parameters, given, plant, deputy), node)
    return loaded


def find_scenario(name: str) -> Path:
    """Path of a scenario's file, given its name or its path."""
    return find_shipped(name, "scenario", "params", "a parameter file")


def sources(name: str, overrides: Mapping[str, Mapping[str, Any]], node: str) -> dict[str, str]:
    """File or "command line" that each parameter of a node comes from, by dotted name; none for a default."""
    found: dict[str, str] = {}
    for path in reversed(extended(find_scenario(name))):
        for pattern, section in _read(path)[1]:
            if matches(pattern, node):
                found |= dict.fromkeys(section, f"{path.stem} {pattern}")
    for pattern, section in overrides.items():
        if matches(f"/{ALL}/*" if pattern.strip("/") == ALL else pattern, node):
            found |= dict.fromkeys(section, "command line")
    return found


def given_to(path: Path, node: str, deputies: Sequence[str]) -> dict[str, Any]:
    """What a parameter file gives a node of a run with these deputies, by dotted name.

    Raises:
        ConfigurationError: the file cannot be read, is no ROS 2 parameter file, or has a section of no node.
    """
    sections = _sections(path)
    _check_sections(str(path), sections, deputies, RUN_NODES)
    return _given(sections, node, MODULES[node.rpartition("/")[2]].parameters)


def _check_sections(source: str, sections: Sections, deputies: Sequence[Any], run_nodes: Sequence[str]) -> None:
    """Raise ConfigurationError for a section that means neither one of `run_nodes` nor a deputy's node."""
    modules = [f"/{deputy}/{row.name}" for deputy in deputies for row in GRAPH]
    nodes = [*run_nodes, *modules]
    patterns = [*nodes, *(f"/**/{row.name}" for row in GRAPH)]
    unknown = [
        f"{pattern} (did you mean {_nearest(pattern, patterns)}?)"
        for pattern, _ in sections
        if not any(matches(pattern, node) for node in nodes)
    ]
    if unknown:
        names = ", ".join(nodes if len(nodes) <= MOST_NAMED else [*nodes[:MOST_NAMED], "..."])
        raise ConfigurationError(f"{source}: sections of no node: {', '.join(unknown)}; the run has {names}")


def _nearest(pattern: str, patterns: Sequence[str]) -> str:
    """The known pattern most like one."""
    return difflib.get_close_matches(f"/{pattern.strip('/')}", patterns, n=1, cutoff=0.0)[0]


def sections_given_to(path: Path, names: Collection[str]) -> Sections:
    """Sections of a parameter file for a node that has these names: pattern of nodes, and values by dotted name."""
    return [(pattern, section) for pattern, section in _sections(path) if any(matches(pattern, name) for name in names)]


def _load(schema: Any, values: Mapping[str, Any], node: str) -> Any:
    try:
        return load(schema, values)
    except ConfigurationError as error:
        raise ConfigurationError(f"{node}: {error}") from None


def _given(sections: Sections, node: str, schema: Any = None) -> dict[str, Any]:
    """Values for a node, without those of rclpy's own; with its schema, also without what is meant for other nodes."""
    values: dict[str, Any] = {}
    for_all = set[str]()
    for pattern, section in sections:
        if matches(pattern, node):
            values |= section
            for_all = for_all | section.keys() if pattern.strip("/") == ALL else for_all - section.keys()
    known = {leaf.name for leaf in leaves(schema, values)} if schema else values.keys()
    return {
        name: value for name, value in values.items() if not _is_of_ros(name) and (name in known or name not in for_all)
    }


def _is_of_ros(name: str) -> bool:
    return name.startswith(OWN_OF_ROS)


def matches(pattern: str, node: str) -> bool:
    """Whether a parameter file's node name, with ``*`` for one token and ``**`` for any, means this node."""
    expression = "".join(
        {"**": "(/[^/]+)*", "*": "/[^/]+"}.get(token, "/" + re.escape(token)) for token in pattern.strip("/").split("/")
    )
    return re.fullmatch(expression, node) is not None


def _sections(path: Path) -> Sections:
    """Node patterns of a parameter file with their parameters by dotted name: those it extends, then its own."""
    return [section for each in reversed(extended(path)) for section in _read(each)[1]]


def extended(path: Path) -> list[Path]:
    """A scenario's file, the one that it extends, and so on; raises ConfigurationError for one that is not there."""
    chain = [path]
    while (base := _read(chain[-1])[0]) is not None:
        beside = chain[-1].parent / base
        try:
            found = beside if base.endswith((".yaml", ".yml")) and beside.is_file() else find_scenario(base)
        except ConfigurationError as error:
            raise ConfigurationError(f"{chain[-1]}: {EXTENDS}: {error}") from None
        if any(found.samefile(each) for each in chain):
            raise ConfigurationError(f"{path}: {EXTENDS} {base}: goes in a circle")
        chain.append(found)
    return chain


def _read(path: Path) -> tuple[str | None, Sections]:
    """Name of the scenario that a file extends, if any, and its own sections in their order."""
    try:
        base, sections = _parsed(path, read_plain(path))
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be read ({error.strerror})") from None
    return base, list(sections)


@lru_cache(maxsize=4)
def _parsed(path: Path, content: bytes) -> tuple[str | None, Sections]:
    """A parameter file's base and sections; a node asks for its own and for the plant's of the same file."""
    try:
        document = read_yaml(content.decode())
    except RejectedYamlError as error:
        raise ConfigurationError(f"{path}: {error}") from None
    except (yaml.YAMLError, ValueError) as error:  # undecodable text, or a date that there is not
        raise ConfigurationError(f"{path}: not YAML ({' '.join(str(error).split())})") from None
    if not isinstance(document, dict):
        raise ConfigurationError(f"{path}: not a ROS 2 parameter file; it must map node names to {SECTION}")
    base = document.get(EXTENDS)
    if base is not None and not isinstance(base, str):
        raise ConfigurationError(f"{path}: {EXTENDS}: {base!r} is not allowed; it must name a scenario or its file")
    return base, list(_walk(path, {name: each for name, each in document.items() if name != EXTENDS}, ""))


def _walk(path: Path, tree: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, dict[str, Any]]]:
    for key, value in tree.items():
        name = f"{prefix}/{key}" if prefix else str(key)
        if not isinstance(value, dict):
            raise ConfigurationError(f"{path}: {name} is not a section; it must map to {SECTION}")
        if key == SECTION and prefix:
            values = list(_flatten(value))
            twice = [name for name, count in Counter(name for name, _ in values).items() if count > 1]
            if twice:
                raise ConfigurationError(f"{path}: {prefix}: parameter {twice[0]} is given twice")
            yield prefix, dict(values)
        elif NODE.fullmatch(name):
            yield from _walk(path, value, name)
        else:
            raise ConfigurationError(
                f"{path}: {name} is no node; a name has letters, digits, _ and / only, or * or ** between /"
            )


def _flatten(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from _flatten(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def duration_of(orbits: float, scenario: Scenario) -> float:
    """Duration (s) of a number of the chief's two-body orbits, in whole ticks."""
    if not 0.0 < orbits < math.inf:
        raise ConfigurationError(f"orbits: {orbits!r} is not allowed; it must be above 0 and finite")
    tick = scenario.plant.tick
    return math.ceil(orbits * 2.0 * math.pi / scenario.plant.mean_motion / tick - 1e-9) * tick
