"""Foxglove layout of a run: a file that Foxglove imports."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from formation_gnc.flight import topics
from formation_gnc.flight.graph import MODULES

LAYOUT = "foxglove_layout.json"
"""File name of the layout among a bag's attachments."""

AXES = ("x radial", "y along-track", "z cross-track")
STATES = (
    (topics.MODE, "mode"),
    (topics.STATUS, "algorithm"),
    (topics.STATUS, "fallback"),
    (topics.ESTIMATE, "status"),
    (topics.MEASUREMENT, "eclipse"),
)
"""Fields that are drawn as bands of states."""


def foxglove_layout(deputies: Sequence[str]) -> str:
    """Layout, JSON, for a run of these deputies: a tab for each, the events of the run beside them."""
    panels = _Panels()
    tabs = [{"title": name, "layout": _deputy_tab(panels, name)} for name in deputies]
    first = panels.add("Tab", "deputies", activeTabIdx=0, tabs=tabs)
    second = _run_column(panels)
    layout = {
        "configById": panels.settings,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1.0},
        "layout": {"direction": "row", "first": first, "second": second, "splitPercentage": 70},
    }
    return json.dumps(layout, indent=1) + "\n"


class _Panels:
    """Settings of all panels by id."""

    def __init__(self) -> None:
        self.settings: dict[str, Any] = {}

    def add(self, kind: str, name: str, **settings: Any) -> str:
        """Add a panel; returns its id."""
        self.settings[f"{kind}!{name}"] = settings
        return f"{kind}!{name}"

    def add_plot(self, name: str, title: str, series: Mapping[str, str], **settings: Any) -> str:
        """Add a plot of message paths by label; returns its id."""
        paths = [
            {"value": path, "label": label, "enabled": True, "timestampMethod": "headerStamp"}
            for label, path in series.items()
        ]
        shown = {"showLegend": True, "legendDisplay": "floating", "isSynced": True, "xAxisVal": "timestamp"}
        return self.add("Plot", name, foxglovePanelTitle=title, paths=paths, **(shown | settings))


def _by_axis(field: str) -> dict[str, str]:
    """Message paths of the first three elements of a field, by label."""
    return {axis: f"{field}[{index}]" for index, axis in enumerate(AXES)}


def _deputy_tab(panels: _Panels, name: str) -> Any:
    """Path and states on the left, time plots on the right."""
    truth = f'{topics.TRUTH.name}.deputies[:]{{name=="{name}"}}.relative_state'
    path = panels.add_plot(
        f"{name}-path",
        "Path in the Hill frame: radial over along-track [m]",
        {"path": f"{truth}[0]"},
        xAxisVal="custom",
        xAxisPath={"value": f"{truth}[1]", "enabled": True},
    )
    states = panels.add(
        "StateTransitions",
        f"{name}-states",
        foxglovePanelTitle="Mode, law, filter and shadow",
        isSynced=True,
        paths=[
            {
                "value": f"{topic.of(name)}.{field}",
                "label": f"{topic.name}.{field}",
                "timestampMethod": "headerStamp",
            }
            for topic, field in STATES
        ],
    )
    vectors = {
        "truth": ("True relative position [m]", truth),
        "estimate": ("Estimated position [m]", f"{topics.ESTIMATE.of(name)}.relative_state"),
        "target": ("Target position [m]", f"{topics.TARGET.of(name)}.relative_state"),
        "thrust": ("Thrust [N]", f"{topics.THRUST.of(name)}.force"),
    }
    plots = [panels.add_plot(f"{name}-{key}", title, _by_axis(field)) for key, (title, field) in vectors.items()]
    times = {module: f'{topics.TIMING.of(name)}{{node=="{module}"}}.compute_time' for module in MODULES}
    plots.append(panels.add_plot(f"{name}-timing", "Compute time [s]", times))
    return _stacked("row", [_stacked("column", [path, states]), _stacked("column", plots)])


def _run_column(panels: _Panels) -> Any:
    """Formation, state, events and log of the whole run, from topics that every bag has: markers need the display."""
    states = f"{topics.TRUTH.name}.deputies[:].relative_state"
    views = [
        panels.add_plot(
            f"formation-{index}",
            f"Formation now: {axis} over along-track [m]",
            {axis: f"{states}[{index}]"},
            xAxisVal="currentCustom",
            xAxisPath={"value": f"{states}[1]", "enabled": True},
        )
        for index, axis in ((0, "radial"), (2, "cross-track"))
    ]
    state = panels.add("DiagnosticSummary", "run", foxglovePanelTitle="Run", topicToRender=topics.DIAGNOSTICS.name)
    events = panels.add("RawMessages", "events", foxglovePanelTitle="Events", topicPath=topics.EVENTS.name)
    log = panels.add("RosOut", "rosout", foxglovePanelTitle="Log of the nodes")
    return _stacked("column", [*views, state, events, log])


def _stacked(direction: str, items: Sequence[Any]) -> Any:
    """Items of equal size in a row or column: a binary tree, as Foxglove splits space."""
    if len(items) == 1:
        return items[0]
    return {
        "direction": direction,
        "first": items[0],
        "second": _stacked(direction, items[1:]),
        "splitPercentage": round(100.0 / len(items), 3),
    }
