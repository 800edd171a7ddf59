"""Writes the generated parts of the documentation from the code: ``python -m tools.write_reference``."""

import re
from collections.abc import Callable, Iterator
from dataclasses import MISSING
from functools import cache
from pathlib import Path
from typing import Any

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller_manager import ControllerParameters
from formation_gnc.guidance.parameters import GuidanceParameters
from formation_gnc.navigation.parameters import NavigationParameters
from formation_gnc.parameters import Leaf, leaves
from formation_gnc.plant.plant import PlantParameters
from formation_gnc.recording.layout import LAYOUT, foxglove_layout
from formation_gnc.recording.parameters import RecorderParameters
from formation_gnc.recording.player import ReplayParameters
from formation_gnc.transport.markers import DisplayParameters
from tools.architecture import FOUNDATION, PACKAGE, ROOT, WINGS, imports, place, wing

DOCS = ROOT / "docs"
COMMAND = "python -m tools.write_reference"

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

<!-- Written by `{COMMAND}`: change the schemas, not this page. -->

Every parameter of every node, from the schemas that the nodes themselves check by. SI units and radians.

- What is not given has its default; what has none must be given. `DEPUTY` stands for each name in `deputies`.
- A value that is not allowed or not finite is rejected with the reason, and so is a name that is not known.
- A parameter that may change in flight does so at the first tick after it was set (`ros2 param set`), or at
  the one that `schedule` foresees. Any other is rejected once the node runs.

A scenario is one ROS 2 parameter file for all nodes: `params/leader_follower.yaml` shows how.
"""


def parameters_page() -> str:
    """The page of all parameters of all nodes."""
    common = list(leaves(CommonParameters, {}))
    known = {leaf.name for leaf in common}
    sections = [INTRODUCTION, "## Every node\n", *_table(common)]
    for node, schema in SCHEMAS.items():
        own = [leaf for leaf in leaves(schema, {"deputies": ["DEPUTY"]}) if leaf.name not in known]
        sections += [f"\n## {node}\n", *_table(own)]
    return "\n".join(sections) + "\n"


def _table(rows: list[Leaf]) -> Iterator[str]:
    yield "| name | type | unit | default | allowed | meaning | in flight |"
    yield "|---|---|---|---|---|---|---|"
    for leaf in rows:
        limits = leaf.limits
        cells = [
            f"`{leaf.name}`",
            leaf.type_name,
            limits.unit,
            _default(leaf),
            limits.allowed(),
            limits.doc,
            "yes" if limits.in_flight else "",
        ]
        yield "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _default(leaf: Leaf) -> str:
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

PAGES: dict[Path, Callable[[], str]] = {
    DOCS / "reference" / "parameters.md": parameters_page,
    DOCS / "reference" / LAYOUT: lambda: foxglove_layout(["deputy1"]),
    ARCHITECTURE: lambda: filled(ARCHITECTURE, {"wings": wings_diagram()}),
}
"""Generated pages, or pages with generated parts, and what should stand in them."""


if __name__ == "__main__":
    for path, text in PAGES.items():
        path.write_text(text(), encoding="utf-8")
