"""The panels in which Foxglove shows a run, as a layout file that it imports."""

import json
from collections.abc import Sequence
from typing import Any

from formation_gnc.flight import topics
from formation_gnc.flight.graph import MODULES

LAYOUT = "foxglove_layout.json"
"""File name of the layout among a bag's attachments."""

AXES = ("x radial", "y along-track", "z cross-track")


STATES = (
    (topics.STATUS, "algorithm"),
    (topics.STATUS, "fallback"),
    (topics.ESTIMATE, "status"),
    (topics.MEASUREMENT, "eclipse"),
)
"""Fields that are drawn as bands of states."""


def foxglove_layout(deputies: Sequence[str]) -> str:
    """A layout for a run of these deputies, JSON: a tab for each, and the events of the run beside them."""
    panels: dict[str, Any] = {}

    def panel(kind: str, name: str, **settings: Any) -> str:
        panels[f"{kind}!{name}"] = settings
        return f"{kind}!{name}"

    def plot(name: str, title: str, series: dict[str, str], **settings: Any) -> str:
        paths = [
            {"value": path, "label": label, "enabled": True, "timestampMethod": "headerStamp"}
            for label, path in series.items()
        ]
        shown = {"showLegend": True, "legendDisplay": "floating", "isSynced": True, "xAxisVal": "timestamp"}
        return panel("Plot", name, foxglovePanelTitle=title, paths=paths, **(shown | settings))

    def by_axis(topic: str, first: int = 0) -> dict[str, str]:
        return {axis: f"{topic}[{first + index}]" for index, axis in enumerate(AXES)}

    def tab(name: str) -> dict[str, Any]:
        truth = f'{topics.TRUTH.name}.deputies[:]{{name=="{name}"}}.relative_state'
        path = plot(
            f"{name}-path",
            "Path in the Hill frame: radial over along-track [m]",
            {"path": f"{truth}[0]"},
            xAxisVal="custom",
            xAxisPath={"value": f"{truth}[1]", "enabled": True},
        )
        state = plot(f"{name}-truth", "True relative position [m]", by_axis(truth))
        estimate = plot(
            f"{name}-estimate", "Estimated position [m]", by_axis(f"{topics.ESTIMATE.of(name)}.relative_state")
        )
        target = plot(f"{name}-target", "Target position [m]", by_axis(f"{topics.TARGET.of(name)}.relative_state"))
        thrust = plot(f"{name}-thrust", "Thrust [N]", by_axis(f"{topics.THRUST.of(name)}.force"))
        timing = plot(
            f"{name}-timing",
            "Compute time [s]",
            {part: f'{topics.TIMING.of(name)}{{node=="{part}"}}.compute_time' for part in MODULES},
        )
        states = panel(
            "StateTransitions",
            f"{name}-states",
            foxglovePanelTitle="Law, filter and shadow",
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
        left = _stacked("column", [path, states])
        return {
            "title": name,
            "layout": _stacked("row", [left, _stacked("column", [state, estimate, target, thrust, timing])]),
        }

    tabs = panel("Tab", "deputies", activeTabIdx=0, tabs=[tab(name) for name in deputies])
    scene = panel(
        "3D",
        "scene",
        foxglovePanelTitle="Hill frame, drawn by the display node",
        followTf="hill",
        followMode="follow-pose",
        topics={topics.MARKERS.name: {"visible": True}},
        cameraState={"distance": 2000.0, "phi": 60.0, "thetaOffset": 45.0, "perspective": True, "fovy": 45.0},
    )
    events = panel("RawMessages", "events", foxglovePanelTitle="Events", topicPath=topics.EVENTS.name)
    state_of_run = panel("DiagnosticSummary", "run", foxglovePanelTitle="Run", topicToRender=topics.DIAGNOSTICS.name)
    said = panel("RosOut", "rosout", foxglovePanelTitle="What the nodes said")
    side = _stacked("column", [scene, state_of_run, events, said])
    layout = {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1.0},
        "layout": {"direction": "row", "first": tabs, "second": side, "splitPercentage": 70},
    }
    return json.dumps(layout, indent=1) + "\n"


def _stacked(direction: str, items: list[Any]) -> Any:
    """Items of the same size one after the other: a binary tree, as Foxglove splits space."""
    if len(items) == 1:
        return items[0]
    rest = _stacked(direction, items[1:])
    return {
        "direction": direction,
        "first": items[0],
        "second": rest,
        "splitPercentage": round(100.0 / len(items), 3),
    }
