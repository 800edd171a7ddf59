"""What the replay of a page moves: orbit, formation, targets, thrust and covariance, thinned to a bounded size."""

from base64 import b64encode
from collections.abc import Mapping
from itertools import cycle
from typing import Any

import numpy as np
from numpy.typing import NDArray

from formation_gnc.analysis.deputy_history import HOUR, DeputyHistory
from formation_gnc.analysis.plot import COLOURS
from formation_gnc.analysis.recorded_parameters import epoch_of, recorded_number
from formation_gnc.analysis.run_history import RunHistory
from formation_gnc.analysis.trajectory import period_of
from formation_gnc.orbit.constants import EARTH_RADIUS, EARTH_ROTATION_RATE
from formation_gnc.orbit.environment import Earth
from formation_gnc.orbit.sky import sun
from formation_gnc.recording.reader import Bag
from formation_gnc.types import Matrix, Vector

FRAMES = 1000
"""Frames of a replay at most; the page interpolates between them, with the velocities."""

NUMBERS = 400_000
"""Numbers of all deputies at most, 2 MB of page: a large fleet has fewer frames."""

PER_DEPUTY = 24
"""Numbers of a deputy in a frame."""

KEEP_OUT = {"guidance": "separation_warning", "supervisor": "least_separation"}
"""Parameters that hold the least distance to other satellites, by module."""

_UPPER = np.triu_indices(3)


@np.errstate(all="ignore")  # what a bag holds may be as large as a float
def scene_of(run: RunHistory, bag: Bag) -> dict[str, Any]:
    """Contents of the replay as JSON: columns are little-endian float32 in base64, in SI; times are float64.

    Every n-th tick that the history keeps is a frame. Thrust is the mean since the frame before, so that none falls
    between two; everything else is as it was at the frame.
    """
    most = min(FRAMES, max(2, NUMBERS // (PER_DEPUTY * max(1, len(run.deputies)))))
    rows = np.arange(0, len(run.time), -(-len(run.time) // most))
    if rows[-1] != len(run.time) - 1:
        rows = np.append(rows, len(run.time) - 1)
    epoch = epoch_of(bag.metadata)
    start = (epoch or 0.0) + HOUR * run.time[0]
    period = period_of(run.chief[0])
    sunward, colours = np.array(sun(start)), run.timeline.colours
    return {
        "times": _text(HOUR * run.time[rows], np.float64),
        "chief": _text(run.chief[rows]),
        "period": period if np.isfinite(period) else HOUR,
        "earth": {
            "radius": EARTH_RADIUS,
            "angle": Earth().rotation_angle(start),
            "rate": EARTH_ROTATION_RATE,
            "sun": (sunward / np.linalg.norm(sunward)).tolist(),
            "dated": epoch is not None,
        },
        "deputies": [
            _deputy(deputy, run.time, rows, bag.metadata) | {"colour": colour}
            for colour, deputy in zip(cycle(COLOURS), run.deputies.values())
        ],
        "events": [
            {
                "time": HOUR * mark.time,
                "colour": colours[mark.kind],
                "text": " · ".join(filter(None, (mark.kind, mark.subject or mark.node, mark.detail))),
            }
            for mark in run.events
        ],
        "eclipses": [
            [deputy.name, HOUR * begin, HOUR * end]
            for deputy in run.deputies.values()
            for begin, end in deputy.eclipses
        ],
    }


def _deputy(
    deputy: DeputyHistory, time: Vector, rows: NDArray[np.int64], metadata: Mapping[str, Mapping[str, Any]]
) -> dict[str, Any]:
    frames = time[rows]
    covariance = deputy.covariance[:, *_UPPER] if len(deputy.covariance) else np.zeros((0, 6))
    impulse = np.diff(deputy.impulse[rows], axis=0, prepend=deputy.impulse[rows[:1]])
    spans = np.diff(HOUR * frames, prepend=np.nan)[:, None]
    distances = [
        recorded_number(metadata, f"/{deputy.name}/{module}", name) or 0.0 for module, name in KEEP_OUT.items()
    ]
    return {
        "name": deputy.name,
        "state": _text(deputy.truth[rows]),
        "target": _text(_at(frames, deputy.target_time, deputy.target)),
        "error": _text(_at(frames, deputy.estimation_time, deputy.estimation_error[:, :3])),
        "covariance": _text(_at(frames, deputy.sigma_time, covariance)),
        "thrust": _text(impulse / spans),
        "keep_out": max(each if np.isfinite(each) else 0.0 for each in distances),
    }


def _at(frames: Vector, time: Vector, values: Matrix) -> Matrix:
    """Values at the frames; not a number where there is none."""
    found = np.full((len(frames), values.shape[1]), np.nan)
    _, places, own = np.intersect1d(frames, time, return_indices=True)
    found[places] = values[own]
    return found


def _text(values: Matrix, kind: type = np.float32) -> str:
    little = np.ascontiguousarray(values, dtype=np.dtype(kind).newbyteorder("<"))
    return b64encode(little.tobytes()).decode("ascii")
