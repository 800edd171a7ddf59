"""Message types and recorded values that are made to take for ever are refused, and the rest of the bag is read."""

import time
from pathlib import Path

import pytest

from formation_gnc.errors import BagError, ConfigurationError
from formation_gnc.messages.conversion import codec, to_cdr
from formation_gnc.parameters import from_json
from formation_gnc.recording import Bag
from formation_gnc.recording.decode import MOST_VALUES, MessageType
from formation_gnc.recording.in_process_recorder import reader
from formation_gnc.recording.provenance import parameters_record
from formation_gnc.recording.session import RecordingSession
from formation_gnc.recording.writer import BagWriter
from formation_gnc.records import Event, EventKind
from formation_gnc.sil.starts import starts_of

LINE = b"=" * 80 + b"\n"


def definition(*parts: str) -> bytes:
    """A schema: the fields of other/msg/A, then those of B, C and so on."""
    first, *others = parts
    return first.encode() + b"".join(
        b"\n" + LINE + f"MSG: other/{name}\n{fields}\n".encode()
        for name, fields in zip("BCDEFGHIJ", others, strict=False)
    )


@pytest.mark.parametrize(
    ("schema", "reason"),
    [
        (definition("other/A inner"), "other/msg/A contains itself"),
        (definition("other/B inner", "other/A[] inner"), "contains itself"),
        (definition("other/B[2] inner", "other/B inner"), "other/msg/B contains itself"),
        (definition(f"float64[{MOST_VALUES + 1}] x"), f"has {MOST_VALUES + 1} values"),
        (definition("float64[1099511627776] x"), "has 1099511627776 values"),
        (definition(*(f"other/{name}[10] x" for name in "BCDEFGHIJ"), "float64 x"), "values, must be at most"),
    ],
    ids=["itself", "by a list of another", "below", "just too many", "array", "nested"],
)
def test_a_type_without_end_is_refused_at_once(schema: bytes, reason: str) -> None:
    begun = time.process_time()
    with pytest.raises(BagError, match="its schema cannot be read") as refusal:
        MessageType("other/msg/A", schema, "ros2msg")
    assert reason in str(refusal.value)
    assert time.process_time() - begun < 1.0


def test_a_type_that_has_another_twice_is_read() -> None:
    kind = MessageType(
        "other/msg/A", definition(f"other/B a\nother/B[3] b\nfloat64[{MOST_VALUES - 4}] c", "uint8 x"), "ros2msg"
    )
    assert kind.fits(b"\0\1\0\0" + bytes(8 + 8 * (MOST_VALUES - 4)))


def test_a_value_nested_too_deeply_is_no_json() -> None:
    assert from_json("[[1.5]]") == [[1.5]]
    with pytest.raises(ValueError, match="nested too deeply"):
        from_json("[" * 100_000 + "]" * 100_000)


def test_a_bag_with_parameters_nested_too_deeply_is_read_and_not_replayed(tmp_path: Path) -> None:
    deep = {"tick": "[" * 100_000 + "]" * 100_000}
    BagWriter(tmp_path / "bag", {parameters_record("/plant"): deep, parameters_record("/a/guidance"): deep}).close()
    bag = Bag(tmp_path / "bag")
    assert bag.tick_ns == 0
    with pytest.raises(ConfigurationError, match="recorded parameters of /a/guidance are no JSON"):
        starts_of(bag, ["/a/guidance"], reader(bag))


def test_what_is_no_event_is_left_out_of_the_bag_and_counted(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag", {})
    session = RecordingSession(writer, "", lambda _: None, codec(Event).decode)
    take = session.open_topic("/events", "formation_gnc_msgs/msg/Event", lambda: {b"1": "/plant"}, True)
    whole = to_cdr(Event(0, 0, "/plant", EventKind.WARNING, "x", [], "words"))
    about = {"stamp": 0, "publisher": b"1", "source_timestamp": 0}
    more = to_cdr(Event(0, 0, "/plant", EventKind.WARNING, "x", [], "more words"))
    for number, data in enumerate([whole, whole[:-9], b"", more], 1):
        take(data, about | {"publication_sequence_number": number})
    assert session.ignored == {"/events": 2}
    session.close()
    bag = Bag(tmp_path / "bag")
    assert [data for _, data, _ in bag.messages()] == [whole, more]
    assert any("2 of /events" in remark for remark in bag.remarks)
