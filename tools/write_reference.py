"""Writes the generated parts of the documentation from the code: ``python -m tools.write_reference``."""

import re
from collections.abc import Callable, Iterator
from dataclasses import MISSING
from functools import cache
from pathlib import Path
from typing import Any

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller_manager import ControllerParameters
from formation_gnc.flight import topics
from formation_gnc.flight.access import NODES_OF_RUN, OF_EVERY_NODE
from formation_gnc.flight.graph import COMMAND, GRAPH, MODULES, RECORDER
from formation_gnc.flight.topics import Topic
from formation_gnc.guidance.parameters import GuidanceParameters
from formation_gnc.navigation.parameters import NavigationParameters
from formation_gnc.parameters import Leaf, leaves
from formation_gnc.plant.faults.fault import Fault
from formation_gnc.plant.faults.plan import FORM
from formation_gnc.plant.faults.registry import FAULTS
from formation_gnc.plant.parameters import PlantParameters
from formation_gnc.recording.layout import LAYOUT, foxglove_layout
from formation_gnc.recording.parameters import RecorderParameters
from formation_gnc.recording.player import ReplayParameters
from formation_gnc.supervision import modes
from formation_gnc.supervision import registry as monitors
from formation_gnc.transport.markers import DisplayParameters
from tools.architecture import FOUNDATION, PACKAGE, ROOT, WINGS, imports, place, wing
from tools.command_reference import commands_page

DOCS = ROOT / "docs"
MESSAGES = ROOT / "msg_defs" / "msg"
HOW_TO_WRITE = "python -m tools.write_reference"

SCHEMAS: dict[str, Any] = {
    "plant": PlantParameters,
    "navigation": NavigationParameters,
    "guidance": GuidanceParameters,
    "controller": ControllerParameters,
    "recorder": RecorderParameters,
    "display": DisplayParameters,
    "replay": ReplayParameters,
}
"""Schema of each node."""

INTRODUCTION = f"""\
# Parameters

<!-- Written by `{HOW_TO_WRITE}`: change the schemas, not this page. -->

Every parameter of every node, from the schemas that the nodes themselves check by. SI units and radians.

- A number may be given as text with its unit: `97.4 deg`, `700 km`, `40 uN`, `1 mm/s`, `1.5 h`; in a list, then,
  all of them. `epoch` may be a date in UTC: `2026-11-28T12:00:00Z`.
- What is not given has its default; what has none must be given. `DEPUTY` stands for each name in `deputies`.
- A parameter whose default is the plant's has the value that the plant has in the same file; so do those of every
  node. One that is given another value keeps it, and a warning at the start says both.
- A value that is not allowed or not finite is rejected with the reason, and so is a name that is not known.
- A parameter that may change in flight does so at the first tick after it was set (`ros2 param set`), or at
  the one that `schedule` foresees. Any other is rejected once the node runs.

A scenario is one ROS 2 parameter file for all nodes: `params/leader_follower.yaml` shows how. With
`extends: leader_follower`, a key beside the nodes, it holds only what differs from that scenario or file;
`formation-gnc` and the launch file read it so, ROS itself takes no such key. `formation-gnc check SCENARIO` shows the
values that result, where each comes from, and what to think of before the flight.
"""

FAULTS_INTRODUCTION = f"""
## Faults

Fields of an entry of the plant's `faults`, besides `at`, `until`, `deputy` and `fault`, such as
`{FORM}`: see [fault injection](../fault_injection.md). One value may stand for a list of one.
"""


def parameters_page() -> str:
    """The page of all parameters of all nodes."""
    common = list(leaves(CommonParameters, {}))
    known = {leaf.name for leaf in common}
    sections = [INTRODUCTION, "## Every node\n", *_table(common)]
    for node, schema in SCHEMAS.items():
        own = [leaf for leaf in leaves(schema, {"deputies": ["DEPUTY"]}) if leaf.name not in known]
        sections += [f"\n## {node}\n", *_table(own)]
    return "\n".join([*sections, FAULTS_INTRODUCTION, *_faults_table()]) + "\n"


def _faults_table() -> Iterator[str]:
    common = [leaf.name for leaf in leaves(Fault, {})]
    yield "| fault | field | type | unit | default | allowed | meaning |"
    yield "|---|---|---|---|---|---|---|"
    for name, fault in FAULTS.items():
        yield f"| `{name}` | | | | | | {str(fault.__doc__).splitlines()[0].rstrip('.')} |"
        for leaf in leaves(fault, {}):
            if leaf.name not in common:
                yield _row([f"`{leaf.name}`", *_cells(leaf)], "| ")


def _table(rows: list[Leaf]) -> Iterator[str]:
    yield "| name | type | unit | default | allowed | meaning | in flight |"
    yield "|---|---|---|---|---|---|---|"
    for leaf in rows:
        yield _row([f"`{leaf.name}`", *_cells(leaf), "yes" if leaf.limits.in_flight else ""])


def _cells(leaf: Leaf) -> list[str]:
    """Type, unit, default, allowed values and meaning."""
    limits = leaf.limits
    return [leaf.type_name, limits.unit, _default(leaf), limits.allowed(), limits.doc]


def _row(cells: list[str], before: str = "") -> str:
    return before + "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _default(leaf: Leaf) -> str:
    if leader := leaf.limits.follows.format(deputy="DEPUTY", fleet="DEPUTY"):
        return f"the plant's `{leader}`"
    if leaf.default is MISSING:
        return "none"
    value = list(leaf.default) if isinstance(leaf.default, tuple) else leaf.default
    return f"`{str(value).lower() if isinstance(value, bool) else repr(value)}`"


def wings_diagram() -> str:
    """Mermaid diagram of the wings, their folders and the arrows of their imports.

    An arrow between wings stands for any import, one inside a wing for imports between its folders. What follows from
    other arrows is left out.
    """
    arrows: dict[str, set[tuple[str, str]]] = {name: set() for name in (PACKAGE, *WINGS)}
    for each in imports():
        if each.target.split(".")[0] != PACKAGE or FOUNDATION in (wing(each.module), wing(each.target)):
            continue
        source, target = wing(each.module), wing(each.target)
        if source != target:
            arrows[PACKAGE].add((source, target))
        elif place(each.module) != place(each.target) and {place(each.module), place(each.target)} <= _folders():
            arrows[source].add((place(each.module), place(each.target)))
    lines = ["flowchart TD"]
    for name in reversed(WINGS):
        members = [each for each in WINGS[name] if each in _folders()]
        lines += [f"  subgraph {name}_wing [{name}]", *(f"    {each}" for each in members)]
        lines += [*(f"    {source} --> {target}" for source, target in _reduced(arrows[name])), "  end"]
    lines += [f"  {source}_wing --> {target}_wing" for source, target in _reduced(arrows[PACKAGE])]
    foundation = sorted(
        each.stem for each in (ROOT / PACKAGE).glob("*.py") if wing(f"{PACKAGE}.{each.stem}") == FOUNDATION
    )
    lines += [f'  foundation["{", ".join(name for name in foundation if name != "__init__")}"]']
    lines += [f"  {next(iter(WINGS))}_wing --> foundation"]
    return "\n".join(["```mermaid", *lines, "```"])


@cache
def _folders() -> frozenset[str]:
    return frozenset(path.parent.name for path in (ROOT / PACKAGE).glob("*/__init__.py"))


def _reduced(arrows: set[tuple[str, str]]) -> list[tuple[str, str]]:
    """Arrows without cycles, less those that a longer way replaces, sorted."""
    reached = set(arrows)
    for middle in {end for arrow in arrows for end in arrow}:
        reached |= {(a, c) for a, b in reached if b == middle for d, c in reached if d == middle}
    return sorted((a, c) for a, c in arrows if not any(a == d and (b, c) in reached for d, b in arrows - {(a, c)}))


def tick_diagram() -> str:
    """Mermaid sequence diagram of one deputy's tick: who gives what to whom, in the order of the graph table."""
    lines = ["sequenceDiagram", *(f"  participant {name}" for name in ("plant", *MODULES, "recorder"))]
    lines += [f"  plant->>{taker}: {topics.MEASUREMENT.name}" for taker in _takers(topics.MEASUREMENT)]
    for row in GRAPH:
        if row.takes_of_others:
            names = ", ".join(each.topic.name for each in row.takes_of_others)
            lines.append(f"  Note over {row.name}: in a fleet, also {names} of every other satellite")
        if row.takes_of_before:
            names = ", ".join(each.topic.name for each in row.takes_of_before)
            lines.append(f"  Note over {row.name}: with {names} of the tick before")
        for topic in row.gives:
            arrow = "->>" if topic.every_tick else "-->>"
            takers = [*_takers(topic), *(["plant"] if topic == COMMAND else [])]
            lines += [f"  {row.name}{arrow}{taker}: {topic.name}" for taker in takers or ["recorder"]]
    lines += ["  Note over plant: next tick when every deputy has answered or missed"]
    return "\n".join(["```mermaid", *lines, "```"])


def _takers(topic: Topic) -> list[str]:
    return [row.name for row in GRAPH if topic in (each.topic for each in row.takes)]


def nodes_table() -> str:
    """Table of what every node subscribes to and publishes."""
    rows = [
        (name, list(map(_on_run, node.takes)), list(map(_on_run, node.gives))) for name, node in NODES_OF_RUN.items()
    ]
    for row in GRAPH:
        takes = [_code(each.topic) for each in row.takes]
        takes += [f"of the tick before {_code(each.topic)}" for each in row.takes_of_before]
        takes += [f"in a fleet {_code(each.topic)} of every other deputy" for each in row.takes_of_others]
        gives = [f"in a fleet {_code(topic)}" if topic.fleet_only else _code(topic) for topic in row.gives]
        rows.append((row.name, takes, [*gives, _code(topics.TIMING)]))
    rows.append((RECORDER, ["every topic there is, as raw bytes"], [_code(topics.PROGRESS)]))
    of_all = list(map(_code, OF_EVERY_NODE))
    rows = [(name, takes, [*gives, *of_all]) for name, takes, gives in rows]
    played = f"{_code(COMMAND)} of every deputy whose {_code(topics.MEASUREMENT)} it plays"
    rows.append(("/replay", [played], ["the topics of a bag", *map(_code, (topics.CLOCK, *OF_EVERY_NODE))]))
    lines = ["| node | subscribes to | publishes |", "|---|---|---|"]
    return "\n".join(
        [*lines, *(f"| `{name}` | {', '.join(takes)} | {', '.join(gives)} |" for name, takes, gives in rows)]
    )


def topics_table() -> str:
    """Table of all topics: message, frame, when, contents."""
    lines = ["| topic | message | frame | when | contents |", "|---|---|---|---|---|"]
    for topic in (*topics.RUN_TOPICS, *topics.DEPUTY_TOPICS):
        message, frame = (topic.record.message, topic.record.frame_id) if topic.record else (topic.message, "")
        lines.append(f"| `{topic.name}` | {_linked(message)} | {frame} | {topic.when} | {topic.contents} |")
    return "\n".join(lines)


def _on_run(topic: Topic) -> str:
    """A topic of a node of the run: a deputy's is that of every one."""
    where = " where tf2_msgs is not installed" if topic is topics.TRANSFORMS else ""
    return f"{_code(topic)}{where}" if topic.name.startswith("/") else f"{_code(topic)} of every deputy"


def _code(topic: Topic) -> str:
    return f"`{topic.name}`"


def _linked(message: str) -> str:
    """A message with a link to its definition, and those of the messages that it is made of."""
    if "/" in message:
        return f"`{message}`"
    definition = (MESSAGES / f"{message}.msg").read_text(encoding="utf-8")
    ours = {path.stem for path in MESSAGES.glob("*.msg")}
    parts = [name for name in re.findall(r"^(\w+)\[", definition, re.MULTILINE) if name in ours]
    return " with ".join(
        ", ".join(f"[`{name}`](../../msg_defs/msg/{name}.msg)" for name in names)
        for names in ([message], list(dict.fromkeys(parts)))
        if names
    )


def filled(page: Path, parts: dict[str, str]) -> str:
    """A written page with its generated parts renewed: what stands between `<!-- NAME: ... -->` and `<!-- end -->`."""
    text = page.read_text(encoding="utf-8")
    for name, part in parts.items():
        places = list(re.finditer(rf"<!-- {name}: .* -->\n", text))
        if len(places) != 1:
            raise ValueError(f"{page}: has {len(places)} places for {name}; it must have one")
        begin = places[0].end()
        text = f"{text[:begin]}{part}\n{text[text.index('<!-- end -->', begin) :]}"
    return text


ARCHITECTURE = DOCS / "architecture.md"
TOPICS = DOCS / "reference" / "topics.md"
SUPERVISION = DOCS / "theory" / "supervision.md"

PAGES: dict[Path, Callable[[], str]] = {
    DOCS / "reference" / "parameters.md": parameters_page,
    DOCS / "reference" / "commands.md": commands_page,
    DOCS / "reference" / LAYOUT: lambda: foxglove_layout(["deputy1"]),
    TOPICS: lambda: filled(TOPICS, {"nodes": nodes_table(), "topics": topics_table()}),
    ARCHITECTURE: lambda: filled(ARCHITECTURE, {"wings": wings_diagram(), "tick": tick_diagram()}),
    SUPERVISION: lambda: filled(
        SUPERVISION,
        {
            "modes": modes.diagram(),
            "transitions": modes.table(),
            "refusals": modes.refusals_table(),
            "monitors": monitors.table(),
            "faults": monitors.default_fault_table(),
        },
    ),
}
"""Generated pages, or pages with generated parts, and what should stand in them."""


if __name__ == "__main__":
    for path, text in PAGES.items():
        path.write_text(text(), encoding="utf-8")
