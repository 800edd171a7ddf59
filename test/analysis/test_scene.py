"""What the replay of a page moves: thinned, aligned with the truth, and bounded in size."""

import json
from base64 import b64decode
from typing import Any

import numpy as np
import pytest

from formation_gnc.analysis import scene
from formation_gnc.analysis.run_history import RunHistory
from formation_gnc.analysis.scene import scene_of
from formation_gnc.orbit.constants import EARTH_RADIUS
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario

FLOAT32 = 1e-6
"""Relative error of a number in the page, with a margin: it is a float32, of 2^-24 at most."""


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Bag:
    directory = tmp_path_factory.mktemp("scene") / "bag"
    parameters = {"parameters /deputy2/guidance": {"separation_warning": "120.0"}}
    with BagWriter(directory, parameters) as writer:
        Run(load_scenario("tetrahedral", {"/plant": {"duration": 200.0}})).fly(InProcessRecorder(writer))
    return Bag(directory)


@pytest.fixture(scope="module")
def run(bag: Bag) -> RunHistory:
    return RunHistory(bag)


def columns(text: str, width: int) -> Any:
    return np.frombuffer(b64decode(text), "<f4").reshape(-1, width)


def test_frames_are_recorded_states(bag: Bag, run: RunHistory) -> None:
    made = scene_of(run, bag)
    assert json.loads(json.dumps(made, allow_nan=False)) == made
    times = np.frombuffer(b64decode(made["times"]), "<f8")
    assert times == pytest.approx(run.time * 3600.0)
    assert columns(made["chief"], 6) == pytest.approx(run.chief, rel=FLOAT32)
    for shown, deputy in zip(made["deputies"], run.deputies.values(), strict=True):
        assert columns(shown["state"], 6) == pytest.approx(deputy.truth, rel=FLOAT32)
        assert columns(shown["target"], 6)[:, :3] == pytest.approx(deputy.target[:, :3], rel=FLOAT32)
        error = columns(shown["error"], 3)
        assert error[np.isfinite(error[:, 0])] == pytest.approx(deputy.estimation_error[:, :3], rel=FLOAT32, abs=1e-12)
    assert [each["keep_out"] for each in made["deputies"]] == [0.0, 120.0, 0.0, 0.0]
    assert made["earth"]["radius"] == EARTH_RADIUS


def test_thrust_of_the_frames_adds_up_to_the_impulse_of_all_ticks(
    bag: Bag, run: RunHistory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scene, "FRAMES", 10)
    made = scene_of(run, bag)
    times = np.frombuffer(b64decode(made["times"]), "<f8")
    assert len(times) <= 11
    assert times[[0, -1]] == pytest.approx(run.time[[0, -1]] * 3600.0), "the end is a frame"
    for shown, deputy in zip(made["deputies"], run.deputies.values(), strict=True):
        thrust = columns(shown["thrust"], 3)[1:]
        total = (thrust * np.diff(times)[:, None]).sum(axis=0)
        flown = deputy.acceleration[1:].sum(axis=0) * run.tick
        assert total == pytest.approx(flown, rel=1e-5, abs=1e-9)  # sums of float32


def test_a_large_fleet_has_fewer_frames(bag: Bag, run: RunHistory, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scene, "NUMBERS", 5000)
    made = scene_of(run, bag)
    columns_of_one = ("state", "target", "error", "covariance", "thrust")
    numbers = sum(len(b64decode(each[name])) / 4 for each in made["deputies"] for name in columns_of_one)
    assert numbers < 1.1 * 5000
