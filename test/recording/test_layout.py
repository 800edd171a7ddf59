import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from formation_gnc.recording import Bag
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.layout import foxglove_layout
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Bag:
    directory = tmp_path_factory.mktemp("layout") / "bag"
    with BagWriter(directory, {}) as writer:
        Run(load_scenario("tetrahedral", {"/plant": {"duration": 20.0}})).fly(InProcessRecorder(writer))
    return Bag(directory)


def paths(settings: Any) -> Iterator[str]:
    """Message paths anywhere in a panel's settings."""
    for key, value in settings.items() if isinstance(settings, dict) else enumerate(settings):
        if isinstance(value, dict | list):
            yield from paths(value)
        elif key in ("value", "topicPath"):
            yield str(value)


def panels(tree: Any) -> Iterator[str]:
    """Names of the panels that a split holds."""
    if isinstance(tree, str):
        yield tree
    else:
        yield from panels(tree["first"])
        yield from panels(tree["second"])


def test_every_path_of_the_layout_is_a_field_of_a_run(bag: Bag, tmp_path: Path) -> None:
    names = [f"deputy{number}" for number in (1, 2, 3, 4)]
    layout = json.loads(foxglove_layout(names))
    found = {
        match.groups()
        for path in paths(layout["configById"])
        if (match := re.fullmatch(r"(/[\w/]+)(?:\.(.+))?", re.sub(r"\{[^}]*\}", "", path)))
    }
    assert len(found) > 4 * 12
    live_only = {topic for topic, _ in found if topic.endswith("/timing")}
    fields = {topic: bag.arrays(topic).keys() for topic in {topic for topic, _ in found} - live_only}
    for topic, field in found:
        if field and topic not in live_only:
            assert re.sub(r"\[\d\]$", "", field).replace("[:]", ".0") in fields[topic], field


def test_every_panel_is_placed_once() -> None:
    layout = json.loads(foxglove_layout(["a", "b"]))
    tabs = layout["configById"]["Tab!deputies"]["tabs"]
    placed = [*panels(layout["layout"]), *(panel for tab in tabs for panel in panels(tab["layout"]))]
    assert sorted(placed) == sorted(layout["configById"])
    assert [tab["title"] for tab in tabs] == ["a", "b"]
