"""Commands that take recorded runs, on in-process flights."""

import json
import signal
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from formation_gnc.analysis.compare import gnc_topics
from formation_gnc.cli import main
from formation_gnc.flight.graph import GRAPH, MODULES
from formation_gnc.flight.topics import QUEUE_DEPTH
from formation_gnc.messages.conversion import codec
from formation_gnc.recording import Bag, identical, read
from formation_gnc.recording.in_process_recorder import reader
from formation_gnc.recording.topic_definition import TopicDefinition
from formation_gnc.recording.writer import BagWriter
from formation_gnc.records import EventKind, Timing
from formation_gnc.sil.replay import replay
from formation_gnc.sil.scenario import find_scenario, load_scenario
from formation_gnc.sil.starts import nodes_of, starts_of
from formation_gnc.types import NANOSECONDS

pytestmark = pytest.mark.usefixtures("without_pictures")


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """Restore the signal handlers."""
    before = signal.getsignal(signal.SIGTERM)
    yield
    signal.signal(signal.SIGTERM, before)


def fly(directory: Path, *arguments: str) -> Path:
    assert main(["sil", "leader_follower", "--in-process", "--bag", str(directory), *arguments]) == 0
    return directory


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fly(tmp_path_factory.mktemp("bags") / "reference", "--duration", "300")


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fly(tmp_path_factory.mktemp("bags") / "other", "--duration", "300", "--seed", "2")


def test_recover_leaves_a_whole_bag_alone(reference: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["recover", str(reference)]) == 0
    assert capsys.readouterr().out.startswith("whole: ")
    assert not reference.with_name("reference_recovered").exists()


def test_recover_saves_a_cut_bag_and_lists_the_losses(
    reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (mcap,) = reference.glob("*.mcap")
    cut = tmp_path / "cut.mcap"
    # a short flight is one chunk, which is saved message by message
    cut.write_bytes(mcap.read_bytes()[: mcap.stat().st_size // 2])
    assert main(["recover", str(cut), "--output", str(tmp_path / "saved"), "--json"]) == 3
    printed = json.loads(capsys.readouterr().out)
    assert printed["status"] == 3
    assert printed["output"] == str(tmp_path / "saved")
    assert any("was not closed" in reason or "chunk" in reason for reason in printed["reasons"])
    saved = Bag(tmp_path / "saved")
    assert saved.damage is None
    assert sum(topic.count for topic in saved.topics.values()) == printed["saved"]
    assert 0 < saved.topics["/truth"].count < Bag(reference).topics["/truth"].count
    assert main(["recover", str(cut)]) == 3
    assert (tmp_path / "cut_recovered").is_dir(), "beside the bag by default"
    assert "damaged: " in capsys.readouterr().out


def test_recover_saves_nothing_of_a_file_of_zeros(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "zeros.mcap").write_bytes(bytes(10_000))
    assert main(["recover", str(tmp_path / "zeros.mcap")]) == 1
    assert "nothing to save" in capsys.readouterr().out
    assert not (tmp_path / "zeros_recovered").exists()


def test_a_missing_bag_is_rejected_in_one_line(
    tmp_path: Path, reference: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = str(tmp_path / "missing")
    for arguments in (["recover", missing], ["compare", str(reference), missing], ["compare", str(reference)]):
        assert main(arguments) == 2
        output, errors = capsys.readouterr()
        assert output == ""
        assert errors.count("\n") == 1


@pytest.mark.thorough
@pytest.mark.filterwarnings("error:.*axes sizes collapsed:UserWarning")  # by a legend of long paths
def test_compare_names_identical_and_different_bags(
    reference: Path, other: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    again = fly(tmp_path / "again", "--duration", "300")
    capsys.readouterr()
    picture = tmp_path / "plot.png"
    assert main(["compare", str(reference), str(again), str(other), "--plot", str(picture)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert f"{again}: identical on every GNC topic" in lines
    assert any(line.startswith(f"{other}: differs from {reference}") for line in lines)
    assert any(line.startswith("  /deputy1/measurement at 0.000000000 s: ") for line in lines), "noise differs at once"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(["compare", str(reference), str(again), str(other), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    same, changed = printed["differences"]
    assert same["identical"]
    assert set(same["figures"]["deputy1"].values()) == {0.0}
    assert not changed["identical"]
    errors = [each["figures"]["deputy1"]["rms_error_m"] for each in printed["bags"]]
    assert changed["figures"]["deputy1"]["rms_error_m"] == errors[2] - errors[0] != 0.0


def replayed(bag: Path, output: Path, *arguments: str) -> tuple[int, Bag]:
    return main(["replay", str(bag), "--bag", str(output), *arguments]), Bag(output)


# a second section for the same nodes, by another pattern, goes on top of the first
SWAPS = """
/*/controller:
  ros__parameters: {schedule: ["{at: 100.0, algorithm: coast}", "{at: 200.0, algorithm: lqr}"]}
/*/navigation: {ros__parameters: {schedule: ["{at: 50.0, sensors: [radius, latitude], gate: 4.0}"]}}
"""


@pytest.mark.thorough
def test_each_run_of_a_joined_bag_has_a_page(reference: Path, other: Path, tmp_path: Path) -> None:
    bags = Bag(reference), Bag(other)
    with BagWriter(tmp_path / "both", {}) as writer:
        for topic in bags[0].topics:
            writer.add_defined_topic(topic, TopicDefinition.recorded(*bags[0].definition(topic)))
        for bag in bags:
            for topic, data, stamp in bag.messages():
                writer.write(topic, data, stamp, 1)
    assert main(["report", str(tmp_path / "both"), "--output", str(tmp_path / "page.html")]) == 0
    assert sorted(path.name for path in tmp_path.glob("page*")) == ["page_run1.html", "page_run2.html"]


@pytest.mark.parametrize("nodes", ["navigation,guidance,controller", "controller", "navigation", "guidance"])
def test_an_unchanged_replay_gives_the_recorded_bits(
    reference: Path, tmp_path: Path, nodes: str, capsys: pytest.CaptureFixture[str]
) -> None:
    status, again = replayed(reference, tmp_path / "again", "--nodes", nodes)
    assert status == 0
    assert capsys.readouterr().out.splitlines()[-1] == "identical on every GNC topic"
    assert {name: topic.count for name, topic in again.topics.items()} == {
        name: topic.count for name, topic in Bag(reference).topics.items()
    }
    assert again.metadata["parameters /deputy1/controller"] == Bag(reference).metadata["parameters /deputy1/controller"]


def test_a_module_that_did_not_fly_is_left_out_of_a_replay_and_told(
    reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As in a bag that was recorded before there was that module."""
    bag, before = Bag(reference), tmp_path / "before"
    metadata = {name: values for name, values in bag.metadata.items() if name != "parameters /deputy1/supervisor"}
    with BagWriter(before, metadata) as writer:
        for topic in bag.topics.keys() - {"/deputy1/mode", "/deputy1/health"}:
            schema, channel = bag.definition(topic)
            assert schema is not None
            writer.add_defined_topic(topic, TopicDefinition(schema.name, schema.data, metadata=channel.metadata))
        for topic, data, stamp in bag.messages():
            if topic not in ("/deputy1/mode", "/deputy1/health"):
                writer.write(topic, data, stamp, 2)
    replayed(before, tmp_path / "again")
    printed = capsys.readouterr()
    assert "/deputy1/supervisor is left out: the bag has neither parameters nor records of it" in printed.out
    assert Bag(tmp_path / "again").topics["/deputy1/thrust"].count == bag.topics["/deputy1/thrust"].count
    assert main(["replay", str(before), "--bag", str(tmp_path / "no"), "--nodes", "supervisor"]) == 2
    assert "has no parameters of /deputy1/supervisor" in capsys.readouterr().err


@pytest.mark.thorough
def test_scheduled_and_manual_changes_replay_at_their_tick(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "swaps.yaml").write_text(find_scenario("leader_follower").read_text() + SWAPS)
    bag = tmp_path / "swaps"
    assert main(["sil", str(tmp_path / "swaps.yaml"), "--in-process", "--bag", str(bag), "--duration", "300"]) == 0
    assert replayed(bag, tmp_path / "again")[0] == 0
    assert list(Bag(bag).arrays("/events")["kind"]).count(EventKind.PARAMETERS) == 3
    # without the schedule in the parameters, the same changes are manual ones
    recorded = Bag(bag)
    nodes = nodes_of(recorded, list(MODULES))
    starts = starts_of(recorded, nodes, reader(recorded), {node: {"schedule": ()} for node in nodes})
    copied: list[tuple[str, int]] = []
    outputs: list[tuple[str, Any]] = []
    replay(
        recorded,
        starts,
        reader(recorded),
        lambda topic, record: outputs.append((topic, record)),
        lambda topic, data, stamp: copied.append((topic, stamp)),
    )
    laws = [record.algorithm for topic, record in outputs if topic == "/deputy1/status"]
    assert laws == ["lqr"] * 100 + ["coast"] * 100 + ["lqr"] * 100
    forces = np.array([record.force for topic, record in outputs if topic == "/deputy1/thrust"])
    assert forces.tobytes() == recorded.arrays("/deputy1/thrust")["force"].tobytes()
    assert not {topic for topic, _ in copied} & {topic for topic, _ in outputs if topic != "/events"}


@pytest.mark.thorough
def test_parameters_asked_for_after_a_change_replay_as_those_of_the_start(tmp_path: Path) -> None:
    (tmp_path / "swaps.yaml").write_text(find_scenario("leader_follower").read_text() + SWAPS)
    bag, node = tmp_path / "swaps", "parameters /deputy1/controller"
    assert main(["sil", str(tmp_path / "swaps.yaml"), "--in-process", "--bag", str(bag), "--duration", "300"]) == 0
    late = {node: Bag(bag).metadata[node] | {"algorithm": '"coast"', "schedule": "[]"}}
    status, again = replayed(rewritten(Bag(bag), tmp_path / "late", {}, late), tmp_path / "again")
    assert status == 0
    assert again.metadata[node]["algorithm"] == '"lqr"'


def rewritten(
    bag: Bag,
    directory: Path,
    numbers: dict[tuple[str, int], int],
    metadata: dict[str, dict[str, str]],
    timings: Iterable[Timing] = (),
) -> Path:
    """A copy with other numbers of messages by topic and stamp, 0 to leave one out, and with more."""
    with BagWriter(directory, bag.metadata | metadata) as writer:
        for topic in bag.topics:
            schema, channel = bag.definition(topic)
            assert schema is not None
            writer.add_defined_topic(topic, TopicDefinition(schema.name, schema.data, metadata=channel.metadata))
        for topic, data, stamp in bag.messages():
            if number := numbers.get((topic, stamp), 2):
                writer.write(topic, data, stamp, number)
        if timings:
            writer.add_topic("/deputy1/timing", "formation_gnc_msgs/msg/Timing", QUEUE_DEPTH)
        for timing in timings:
            number = numbers.get(("/deputy1/timing", timing.time), 2)
            writer.write("/deputy1/timing", codec(Timing).encode(timing), timing.time, number)
    return directory


@pytest.mark.thorough
def test_answers_to_missing_inputs_are_copied_and_reported(
    reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lost = {("/deputy1/estimate", 50 * NANOSECONDS): 0}
    lacking = rewritten(Bag(reference), tmp_path / "lacking", lost, {})
    status, again = replayed(lacking, tmp_path / "again", "--nodes", "guidance,controller")
    assert status == 0
    assert "2 answers as recorded" in capsys.readouterr().out
    assert again.topics["/deputy1/thrust"].count == Bag(reference).topics["/deputy1/thrust"].count


@pytest.mark.thorough
def test_outputs_of_a_killed_node_are_not_expected(
    reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, end = "/deputy1/status", 50 * NANOSECONDS
    ticks = Bag(reference).arrays(status)["stamp_ns"].tolist()
    timings = {stamp: Timing(stamp, "controller", 100_000) for stamp in ticks}
    lost = {(status, end): 0}
    whole = rewritten(Bag(reference), tmp_path / "whole", lost, {}, timings.values())
    assert replayed(whole, tmp_path / "whole again", "--nodes", "controller")[0] == 1
    assert f"differs: {status} at 50.000000000 s: only in the second bag" in capsys.readouterr().out
    del timings[end]
    killed = rewritten(Bag(reference), tmp_path / "killed", lost, {}, timings.values())
    assert replayed(killed, tmp_path / "killed again", "--nodes", "controller")[0] == 0


@pytest.mark.thorough
def test_what_a_killed_node_told_others_but_not_the_recorder_is_flown(
    reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A mode that has reached navigation and the rest, whose answers say that they had it, and not the bag."""
    end, bag = 50 * NANOSECONDS, Bag(reference)
    inputs = {row.name: (len(row.takes), len(row.takes_of_before)) for row in GRAPH}
    timings = [
        Timing(stamp, name, 100_000, [] if stamp else list(range(needed, needed + delayed)))
        for stamp in bag.arrays("/deputy1/status")["stamp_ns"].tolist()
        for name, (needed, delayed) in inputs.items()
        if (stamp, name) != (end, "supervisor")
    ]
    lost = {("/deputy1/mode", end): 0, ("/deputy1/health", end): 0}
    killed = rewritten(bag, tmp_path / "killed", lost, {}, timings)
    status, again = replayed(killed, tmp_path / "again")
    printed = capsys.readouterr().out
    assert status == 0, printed
    assert "as recorded, not flown" not in printed
    assert end not in again.arrays("/deputy1/mode")["stamp_ns"], "what was not recorded is not added"


@pytest.mark.thorough
def test_a_restarted_node_replays_with_its_recorded_parameters(
    reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    start, node = 50 * NANOSECONDS, "/deputy1/controller"
    first = {("/deputy1/thrust", start): 1}
    values = Bag(reference).metadata[f"parameters {node}"]
    coast = {f"parameters {node} from {start}": values | {"algorithm": '"coast"'}}
    for name, metadata in (("known", coast), ("unknown", {})):
        bag = rewritten(Bag(reference), tmp_path / name, first, metadata)
        status, again = replayed(bag, tmp_path / f"{name} again", "--nodes", "controller")
        remark = f"{node} was started again at 50 s; the bag lacks with which parameters"
        printed = capsys.readouterr().out
        laws = again.arrays("/deputy1/status")["algorithm"].tolist()
        if name == "known":  # LQR is what is recorded there
            assert status == 1
            assert remark not in printed
            assert laws == ["lqr"] * 50 + ["coast"] * (len(laws) - 50)
        else:
            assert status == 0
            assert remark in printed
            assert set(laws) == {"lqr"}
    # an override holds at every start
    wanted = tmp_path / "wanted.yaml"
    wanted.write_text("/**/controller: {ros__parameters: {algorithm: hinf}}")
    _, again = replayed(tmp_path / "known", tmp_path / "other", "--nodes", "controller", "--params", str(wanted))
    assert set(again.arrays("/deputy1/status")["algorithm"].tolist()) == {"hinf"}


@pytest.mark.thorough
def test_a_restarted_node_replays_from_its_first_tick_answered_or_not(reference: Path, tmp_path: Path) -> None:
    """Navigation that comes back between two fixes has finished a tick, and said so, before its first estimate."""
    first, start, node = 49 * NANOSECONDS, 50 * NANOSECONDS, "/deputy1/controller"
    ticks = Bag(reference).arrays("/deputy1/status")["stamp_ns"].tolist()
    unanswered = {("/deputy1/thrust", first): 0, ("/deputy1/status", first): 0}
    begun = {("/deputy1/timing", first): 1, ("/deputy1/thrust", start): 1}
    values = Bag(reference).metadata[f"parameters {node}"] | {"algorithm": '"coast"'}
    coast = {f"parameters {node} from {start}": values}
    timings = [Timing(stamp, "controller", 100_000) for stamp in ticks]
    bag = rewritten(Bag(reference), tmp_path / "bag", unanswered | begun, coast, timings)
    _, again = replayed(bag, tmp_path / "again", "--nodes", "controller")
    laws = again.arrays("/deputy1/status")["algorithm"].tolist()
    assert laws == ["lqr"] * 49 + ["coast"] * (len(laws) - 49)


@pytest.mark.thorough
def test_a_changed_replay_differs_only_where_it_was_changed(
    reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    changed = tmp_path / "changed.yaml"
    changed.write_text("/**/controller: {ros__parameters: {algorithm: coast}}\n")
    status, again = replayed(reference, tmp_path / "again", "--params", str(changed), "--nodes", "controller")
    assert status == 0
    differing = [difference.topic for difference in identical(Bag(reference), again, gnc_topics(again))]
    assert differing == ["/deputy1/status", "/deputy1/thrust"]
    assert not again.arrays("/deputy1/thrust")["force"].any(), "coasting commands nothing"


def test_replay_rejects_invalid_nodes_and_parameters(
    reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("/**/controller: {ros__parameters: {algorithm: magic}}\n")
    for arguments, printed in (
        (["--nodes", "plant"], "nodes plant: must be some of navigation, guidance, controller"),
        (["--params", str(wrong)], "/deputy1/controller: parameter algorithm: 'magic' is not allowed"),
        (["--params", str(tmp_path / "missing.yaml")], "missing.yaml"),
        (["--bag", str(tmp_path)], "exists already"),
    ):
        assert main(["replay", str(reference), "--bag", str(tmp_path / "no"), *arguments]) == 2
        assert printed in capsys.readouterr().err


@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_export_writes_topics_and_attachments(
    reference: Path, tmp_path: Path, form: str, capsys: pytest.CaptureFixture[str]
) -> None:
    everything, some = tmp_path / "all", tmp_path / "some"
    assert main(["export", str(reference), "--format", form, "--output", str(everything), "--attachments"]) == 0
    bag = Bag(reference)
    written = {path.name for path in everything.iterdir()}
    filled = {topic.strip("/").replace("/", ".") for topic, each in bag.topics.items() if each.count}
    assert written == {f"{topic}.{form}" for topic in filled} | set(bag.attachments)
    assert load_scenario(str(everything / "leader_follower.yaml")).plant.duration == 300.0, "flyable"
    assert main(["export", str(reference), "--format", form, "--topic", "/truth", "--output", str(some)]) == 0
    (table,) = some.iterdir()
    frame = pd.read_csv(table) if form == "csv" else pd.read_parquet(table)
    assert frame["deputies.0.mass"].tolist() == bag.arrays("/truth")["deputies.0.mass"].tolist()
    assert read(reference)["/truth"]["deputies.0.mass"].tolist() == frame["deputies.0.mass"].tolist()
    capsys.readouterr()
    assert main(["export", str(reference), "--topic", "/nothing", "--output", str(some)]) == 2
    assert "has no topic /nothing" in capsys.readouterr().err
    assert main(["export", str(reference), "--output", "/proc/nowhere"]) == 2
    assert "export to /proc/nowhere: " in capsys.readouterr().err
