"""Writes what the schemas say into docs/reference, of a clone: ``python -m formation_gnc.reference``."""

from collections.abc import Iterator
from dataclasses import MISSING
from pathlib import Path
from typing import Any

from formation_gnc.common import CommonParameters
from formation_gnc.control.controller_manager import ControllerParameters
from formation_gnc.guidance.parameters import GuidanceParameters
from formation_gnc.navigation.navigation_filter import NavigationParameters
from formation_gnc.parameters import Leaf, leaves
from formation_gnc.plant.plant import PlantParameters
from formation_gnc.recording.layout import LAYOUT, foxglove_layout
from formation_gnc.recording.parameters import RecorderParameters
from formation_gnc.recording.player import ReplayParameters
from formation_gnc.transport.markers import DisplayParameters

PAGE = Path(__file__).resolve().parents[1] / "docs" / "reference" / "parameters.md"
LAYOUT_PAGE = PAGE.with_name(LAYOUT)

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

INTRODUCTION = """\
# Parameters

<!-- Written by `python -m formation_gnc.reference`: change the schemas, not this page. -->

Every parameter of every node, from the schemas that the nodes themselves check by. SI units and radians.

- What is not given has its default; what has none must be given. `DEPUTY` stands for each name in `deputies`.
- A value that is not allowed or not finite is rejected with the reason, and so is a name that is not known.
- A parameter that may change in flight does so at the first tick after it was set (`ros2 param set`), or at
  the one that `schedule` foresees. Any other is rejected once the node runs.

A scenario is one ROS 2 parameter file for all nodes: `params/leader_follower.yaml` shows how.
"""


def page() -> str:
    """The page as it should be."""
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


if __name__ == "__main__":
    PAGE.parent.mkdir(parents=True, exist_ok=True)
    PAGE.write_text(page())
    LAYOUT_PAGE.write_text(foxglove_layout(["deputy1"]))
