"""A run read once and thinned is the run read whole."""

from pathlib import Path

import numpy as np
import pytest

from formation_gnc.analysis.metrics import deputies_of, figures, trajectory
from formation_gnc.analysis.overview import draw_overview, draw_panels
from formation_gnc.analysis.run_history import Mark, RunHistory
from formation_gnc.analysis.separation import minimum_separation
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario
from formation_gnc.transport.in_process_recorder import InProcessRecorder


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Bag:
    directory = tmp_path_factory.mktemp("flown") / "bag"
    overrides = {"/plant": {"duration": 250.0}, "/**/guidance": {"schedule": []}}
    overrides["/**/controller"] = {"schedule": ["{at: 50.0, algorithm: coast}"]}
    with BagWriter(directory, {}) as writer:
        Run(load_scenario("tetrahedral", overrides)).fly(InProcessRecorder(writer))
    return Bag(directory)


@pytest.fixture(scope="module")
def flown(bag: Bag) -> RunHistory:
    return RunHistory(bag)


def test_a_short_run_is_all_there(bag: Bag, flown: RunHistory) -> None:
    whole = figures(bag)
    for name, deputy in flown.deputies.items():
        read = trajectory(bag, name)
        assert np.array_equal(deputy.truth, read.truth)
        assert np.array_equal(deputy.error, read.estimation_error)
        assert np.array_equal(deputy.control[:, :3], read.error)
        assert np.array_equal(deputy.sigma, read.sigma)
        assert np.array_equal(deputy.acceleration[1:], read.applied)
        # another order of adding up
        assert deputy.spent == pytest.approx(whole.deputies[name].delta_v_m_s, rel=1e-12)
        assert {sensor: len(rows) for sensor, rows in deputy.readings.items()} == dict.fromkeys(deputy.readings, 25)
    truth, names = bag.arrays("/truth"), deputies_of(bag)
    places = [truth[f"deputies.{index}.relative_state"][:, :3] for index in range(len(names))]
    assert flown.nearest == minimum_separation(truth["time"], np.array(places), names)
    assert len(flown.distances) == 6
    assert min(rows[:, 1].min() for rows in flown.distances.values()) == flown.nearest.distance


def test_batches_of_all_topics_are_those_of_each(bag: Bag) -> None:
    topics = ["/truth", "/deputy2/estimate", "/events"]
    read: dict[str, list[np.ndarray]] = {topic: [] for topic in topics}
    for topic, batch in bag.batches(topics, size=64):
        assert 0 < len(batch["stamp_ns"]) <= 64
        read[topic].append(batch["stamp_ns"])
    for topic, stamps in read.items():
        assert np.concatenate(stamps).tolist() == bag.arrays(topic)["stamp_ns"].tolist()


def test_an_event_concerns_its_deputy_or_everybody(flown: RunHistory) -> None:
    swaps = [mark for mark in flown.events_of("deputy2") if mark.kind == "parameters"]
    assert [mark.node for mark in swaps] == ["/deputy2/controller"]
    flown.events.append(Mark(0.1, "miss", "/plant", "deputy1", "no answer: no thrust"))
    flown.events.append(Mark(0.1, "new", "/fleet", "", "a kind that nobody foresaw"))
    kinds = {name: {mark.kind for mark in flown.events_of(name)} for name in flown.deputies}
    assert "miss" in kinds["deputy1"]
    assert "miss" not in kinds["deputy2"]
    assert all({"new", "end"} <= each for each in kinds.values())


def test_pictures_of_a_fleet_and_of_each_panel(flown: RunHistory, tmp_path: Path) -> None:
    pictures = [draw_overview(flown, tmp_path / "overview.png", "four"), *draw_panels(flown, tmp_path)]
    assert len(pictures) == 1 + 4 * 4
    assert all(picture.read_bytes().startswith(b"\x89PNG") for picture in pictures)
