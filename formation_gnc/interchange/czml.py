"""CZML, the scene description of Cesium: the satellites around the Earth, and the deputies in the chief's frame."""

import json
from collections.abc import Sequence
from datetime import datetime, timedelta
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from formation_gnc.analysis.plot import COLOURS
from formation_gnc.interchange.ephemeris import Ephemeris
from formation_gnc.interchange.times import utc
from formation_gnc.types import Matrix, Vector

SPEED_UP = 60.0
"""Of the clock when the scene is opened."""


def write_czml(satellites: Sequence[Ephemeris], path: Path) -> None:
    """Write all satellites of a run into one scene: positions in Cesium's inertial frame, m.

    Each carries its position relative to the chief along Hill's axes as the property `hill`, m, over the same times.
    """
    first = satellites[0]
    start = utc(first.epoch + float(first.times[0]))
    stop = start + timedelta(seconds=float(first.times[-1] - first.times[0]))
    span = f"{_iso(start)}/{_iso(stop)}"
    document: list[dict[str, Any]] = [
        {
            "id": "document",
            "name": path.stem,
            "version": "1.0",
            "clock": {"interval": span, "currentTime": _iso(start), "multiplier": SPEED_UP, "range": "LOOP_STOP"},
        }
    ]
    for satellite, colour in zip(satellites, cycle(COLOURS), strict=False):
        rgba = [*bytes.fromhex(colour[1:]), 255]
        times = satellite.times - satellite.times[0]
        document.append(
            {
                "id": satellite.name,
                "name": satellite.name,
                "availability": span,
                "position": _sampled(start, times, satellite.states[:, :3], "INERTIAL"),
                "properties": {"hill": _sampled(start, times, satellite.relative[:, :3], "FIXED")},
                "point": {"pixelSize": 8, "color": {"rgba": rgba}},
                "label": {"text": satellite.name, "pixelOffset": {"cartesian2": [12, 0]}, "font": "12pt sans-serif"},
                "path": {"width": 1, "leadTime": 0, "material": {"solidColor": {"color": {"rgba": rgba}}}},
            }
        )
    path.write_text(json.dumps(document, allow_nan=False), encoding="utf-8")


def _sampled(start: datetime, times: Vector, positions: Matrix, frame: str) -> dict[str, Any]:
    """A position that Cesium interpolates; times (N,) s since the start."""
    return {
        "epoch": _iso(start),
        "referenceFrame": frame,
        "interpolationAlgorithm": "LAGRANGE",
        "interpolationDegree": 5,
        "cartesian": np.column_stack((times, positions)).ravel().tolist(),
    }


def _iso(date: datetime) -> str:
    return f"{date:%Y-%m-%dT%H:%M:%S.%f}Z"
