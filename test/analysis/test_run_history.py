"""A run that is read once and thinned equals the run read as a whole."""

import math

import numpy as np
import pytest

from formation_gnc.analysis.figures import figures
from formation_gnc.analysis.run_history import RunHistory
from formation_gnc.analysis.separation import minimum_separation
from formation_gnc.analysis.thinning import POINTS, Thinned, points_of
from formation_gnc.analysis.timeline import Mark
from formation_gnc.analysis.trajectory import deputies_of, trajectories
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Bag:
    directory = tmp_path_factory.mktemp("history") / "bag"
    overrides = {"/plant": {"duration": 250.0}, "/**/guidance": {"schedule": []}}
    overrides["/**/controller"] = {"schedule": ["{at: 50.0, algorithm: coast}"]}
    with BagWriter(directory, {}) as writer:
        Run(load_scenario("tetrahedral", overrides)).fly(InProcessRecorder(writer))
    return Bag(directory)


@pytest.fixture(scope="module")
def history(bag: Bag) -> RunHistory:
    return RunHistory(bag)


def test_a_short_run_is_complete(bag: Bag, history: RunHistory) -> None:
    whole = figures(bag)
    for name, deputy in history.deputies.items():
        path = trajectories(bag)[name]
        assert np.array_equal(deputy.truth, path.truth)
        assert np.array_equal(deputy.estimation_error, path.estimation_error)
        assert np.array_equal(deputy.control_error[:, :3], path.error)
        assert np.array_equal(deputy.sigma, path.sigma)
        assert np.array_equal(deputy.acceleration[1:], path.applied)
        # another order of summation
        assert deputy.total_delta_v == pytest.approx(whole.deputies[name].delta_v_m_s, rel=1e-12)
        assert {channel: len(rows) for channel, rows in deputy.readings.items()} == {
            ("radius", 0): 25,
            ("range_rate", 0): 25,
            ("latitude", 0): 25,
        }


def test_nearest_approach_is_that_of_all_pairs(bag: Bag, history: RunHistory) -> None:
    truth, names = bag.arrays("/truth"), deputies_of(bag)
    positions = [truth[f"deputies.{index}.relative_state"][:, :3] for index in range(len(names))]
    assert history.nearest == minimum_separation(truth["time"], np.array(positions), names)
    assert len(history.distances) == 6
    assert min(rows[:, 1].min() for rows in history.distances.values()) == history.nearest.distance


def test_batches_of_several_topics_equal_those_of_each(bag: Bag) -> None:
    topics = ["/truth", "/deputy2/estimate", "/events"]
    read: dict[str, list[np.ndarray]] = {topic: [] for topic in topics}
    for topic, batch in bag.batches(topics, size=64):
        assert 0 < len(batch["stamp_ns"]) <= 64
        read[topic].append(batch["stamp_ns"])
    for topic, stamps in read.items():
        assert np.concatenate(stamps).tolist() == bag.arrays(topic)["stamp_ns"].tolist()


def test_an_event_concerns_its_deputy_or_all(history: RunHistory) -> None:
    changes = [mark for mark in history.timeline_of("deputy2").events if mark.kind == "parameters"]
    assert [mark.node for mark in changes] == ["/deputy2/controller"]
    history.events.append(Mark(0.1, "miss", "/plant", "deputy1", "no answer: no thrust"))
    history.events.append(Mark(0.1, "new", "/fleet", "", "an unknown kind of event"))
    kinds = {name: {mark.kind for mark in history.timeline_of(name).events} for name in history.deputies}
    assert "miss" in kinds["deputy1"]
    assert "miss" not in kinds["deputy2"]
    assert all({"new", "end"} <= each for each in kinds.values())


def test_a_thinned_curve_has_bounded_length_and_even_steps() -> None:
    thinned = Thinned(1, POINTS)
    for start in range(0, 50_000, 777):
        thinned.add(np.arange(start, start + 777, dtype=float)[:, None])
        assert len(thinned.rows) <= 2 * POINTS
    steps = np.unique(np.diff(thinned.rows[:, 0]))
    assert len(steps) == 1
    assert math.log2(steps[0]).is_integer()


def test_the_curves_of_a_fleet_are_no_heavier_than_those_of_a_few() -> None:
    assert [points_of(each) for each in (0, 1, 4, 8, 16, 50)] == [POINTS, POINTS, POINTS, 1000, 500, 500]
