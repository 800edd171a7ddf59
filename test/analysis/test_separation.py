"""Nearest approaches against those of every pair at distances time."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formation_gnc.analysis.separation import minimum_separation, predicted_approach
from formation_gnc.cli import main
from formation_gnc.recording.reader import Bag


@settings(deadline=None)
@given(st.integers(2, 5), st.integers(1, 20), st.integers(0, 1000))
def test_minimum_separation_is_the_least_of_all_pairs_and_times(satellites: int, times_count: int, seed: int) -> None:
    positions = np.random.default_rng(seed).normal(size=(satellites, times_count, 3))
    times, names = 10.0 * np.arange(times_count), [f"s{index}" for index in range(satellites)]
    found = minimum_separation(times, positions, names)
    assert found is not None
    distances = {
        (times[k], names[i], names[j]): math.dist(positions[i, k], positions[j, k])
        for k in range(times_count)
        for i in range(satellites)
        for j in range(i + 1, satellites)
    }
    assert found.distance == pytest.approx(min(distances.values()))
    assert distances[found.time, *found.pair] == pytest.approx(found.distance)


def test_a_single_satellite_has_no_separation() -> None:
    assert minimum_separation(np.zeros(1), np.zeros((1, 1, 3)), ["alone"]) is None


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.thorough
def test_predicted_approach_is_the_least_published_separation(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("signal.signal", lambda *_: None)  # the command sets signal handlers
    bags = {name: tmp_path / name for name in ("tetrahedral", "leader_follower")}
    summaries = {}
    for name, bag in bags.items():
        assert main(["sil", name, "--in-process", "--json", "--duration", "100", "--bag", str(bag)]) == 0
        summaries[name] = json.loads(capsys.readouterr().out)
    fleet, alone = (Bag(bag) for bag in bags.values())
    for kind in ("planned", "passive"):
        published = {f"deputy{k}": fleet.arrays(f"/deputy{k}/separation")[kind].min() for k in (1, 2, 3, 4)}
        found = predicted_approach(fleet, kind)
        assert found is not None
        assert found.distance == min(published.values()) == published[found.pair[0]]
        assert found.pair[1] in published.keys() - {found.pair[0]}
        assert summaries["tetrahedral"][f"{kind}_separation_m"] == found.distance
        assert predicted_approach(alone, kind) is None
        assert f"{kind}_separation_m" not in summaries["leader_follower"]
