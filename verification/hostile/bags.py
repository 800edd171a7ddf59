"""Hostile bags, each made of a whole one: damaged, altered with right checksums, or none at all."""

import os
import re
import shutil
import sqlite3
import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from random import Random
from typing import Any

import zstandard
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

Change = Callable[[Path, Path], None]
"""Makes a hostile bag at a path, of the whole one's only file."""

NOISE = Random(18)
MAGIC = b"\x89MCAP0\r\n"
THRUST, TRUTH, ESTIMATE, MEASUREMENT = "/deputy1/thrust", "/truth", "/deputy1/estimate", "/deputy1/measurement"


@dataclass(frozen=True)
class Message:
    """One message of a bag."""

    topic: str
    data: bytes
    time: int
    """ns."""


@dataclass
class Content:
    """What an MCAP file holds, to be written again with checksums that are right."""

    kinds: dict[str, tuple[str, str, bytes, str]] = field(default_factory=dict)
    """By topic: name, encoding and text of the schema, and encoding of the messages."""
    messages: list[Message] = field(default_factory=list)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)

    @classmethod
    def of(cls, file: Path) -> "Content":
        """That of a whole file."""
        content = cls()
        with file.open("rb") as stream:
            reader = make_reader(stream)
            for schema, channel, message in reader.iter_messages(log_time_order=False):
                assert schema is not None
                content.kinds[channel.topic] = schema.name, schema.encoding, schema.data, channel.message_encoding
                content.messages.append(Message(channel.topic, message.data, message.log_time))
            content.metadata = {each.name: dict(each.metadata) for each in reader.iter_metadata()}
            content.attachments = {each.name: each.data for each in reader.iter_attachments()}
        return content

    def write(self, file: Path, compression: CompressionType = CompressionType.ZSTD) -> None:
        """Write a file of its own."""
        with file.open("wb") as stream:
            writer = Writer(stream, chunk_size=8192, compression=compression, enable_data_crcs=True)
            writer.start("ros2")
            channels: dict[str, int] = {}
            for topic, (name, encoding, text, form) in self.kinds.items():
                schema = writer.register_schema(name, encoding, text) if name else 0
                channels[topic] = writer.register_channel(topic, form, schema)
            for number, each in enumerate(self.messages):
                writer.add_message(channels[each.topic], each.time, each.data, each.time, number)
            for title, values in self.metadata.items():
                writer.add_metadata(title, values)
            for title, data in self.attachments.items():
                writer.add_attachment(0, 0, title, "application/octet-stream", data)
            writer.finish()


def raw(change: Callable[[bytes], bytes]) -> Change:
    """A change of the file's bytes."""
    return lambda whole, place: (place / "bag.mcap").write_bytes(change(whole.read_bytes())) and None  # type: ignore[func-returns-value]


def rewritten(change: Callable[[Content], object]) -> Change:
    """A change of what it holds, with new checksums."""

    def make(whole: Path, place: Path) -> None:
        content = Content.of(whole)
        change(content)
        content.write(place / "bag.mcap")

    return make


def each(topic: str, change: Callable[[bytes], bytes], every: int = 1, after: int = 0) -> Change:
    """A change of the data of a topic's messages: of every so many, after the first ones."""

    def alter(content: Content) -> None:
        rows = [row for row, message in enumerate(content.messages) if message.topic == topic][after::every]
        for row in rows:
            content.messages[row] = replace(content.messages[row], data=change(content.messages[row].data))

    return rewritten(alter)


def without(topic: str, part: slice = slice(None)) -> Change:
    """Without the messages of a topic, or some of them."""

    def leave_out(content: Content) -> None:
        gone = [row for row, message in enumerate(content.messages) if message.topic == topic][part]
        content.messages = [message for row, message in enumerate(content.messages) if row not in set(gone)]

    return rewritten(leave_out)


def typed(topic: str, *kind: Any) -> Change:
    """With another type for a topic."""
    return rewritten(lambda content: content.kinds.update({topic: kind}))


def added(topic: str, kind: tuple[str, str, bytes, str], *data: bytes) -> Change:
    """With a topic and messages besides."""

    def add(content: Content) -> None:
        content.kinds[topic] = kind
        content.messages += [Message(topic, one, content.messages[-1].time) for one in data]

    return rewritten(add)


def metadata(pattern: str, change: Callable[[dict[str, str]], dict[str, str]]) -> Change:
    """A change of the metadata records whose names match."""

    def alter(content: Content) -> None:
        names = [name for name in content.metadata if re.search(pattern, name)] or [pattern]
        content.metadata.update({name: change(content.metadata.get(name, {})) for name in names})

    return rewritten(alter)


def flipped(near: bytes, shift: int = 0) -> Change:
    """A bit flipped where some bytes stand first, or so many bytes further."""

    def flip(data: bytes) -> bytes:
        at = data.index(near) + shift
        return data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]

    return raw(flip)


def restamped(change: Callable[[int, int], int], topic: str = "") -> Change:
    """Another header stamp (s) for the messages of a topic, or of all: of its number and the one it has."""

    def alter(content: Content) -> None:
        for row, message in enumerate(content.messages):
            if topic in ("", message.topic) and not message.topic.startswith("/events"):
                (second,) = struct.unpack_from("<i", message.data, 4)
                stamp = max(-(2**31), min(change(row, second), 2**31 - 1))
                data = message.data[:4] + struct.pack("<i", stamp) + message.data[8:]
                content.messages[row] = replace(message, data=data)

    return rewritten(alter)


def doubles(value: float) -> Callable[[bytes], bytes]:
    """The last four doubles of a message replaced."""
    return lambda data: data[:-32] + struct.pack("<d", value) * 4


def records(data: bytes) -> Iterator[tuple[int, int, bytes]]:
    """Offset, kind and content of the records of a file."""
    at = len(MAGIC)
    while at + 9 <= len(data) - len(MAGIC):
        kind, length = struct.unpack_from("<BQ", data, at)
        yield at, kind, data[at + 9 : at + 9 + length]
        at += 9 + length


def in_chunk(change: Callable[[bytearray], None], checksum: bool = True) -> Change:
    """A change of the first chunk's head: times, size, checksum and compression stand in its first bytes."""

    def alter(data: bytes) -> bytes:
        at = next(at for at, kind, _ in records(data) if kind == 6) + 9
        head = bytearray(data[at : at + 64])
        change(head)
        data = data[:at] + bytes(head) + data[at + 64 :]
        return unsealed(data) if checksum else data

    return raw(alter)


def unsealed(data: bytes) -> bytes:
    """Without the checksum of the data section."""
    at = next(at for at, kind, _ in records(data) if kind == 15) + 9
    return data[:at] + bytes(4) + data[at + 4 :]


def resealed(change: Callable[[bytes], bytes]) -> Change:
    """A change of the data section, of which the checksum is made anew."""

    def alter(data: bytes) -> bytes:
        data = change(data)
        at = next(at for at, kind, _ in records(data) if kind == 15)
        return data[: at + 9] + struct.pack("<I", zlib.crc32(data[:at])) + data[at + 13 :]

    return raw(alter)


def bomb(whole: Path, place: Path) -> None:
    """A chunk of a few kilobytes that unpacks to two gigabytes of zeros."""
    size = 2 << 30
    packer = zstandard.ZstdCompressor().compressobj(size=size)
    packed = b"".join([*(packer.compress(bytes(1 << 24)) for _ in range(size >> 24)), packer.flush()])
    body = (
        struct.pack("<QQQI", 0, 1, size, 0) + struct.pack("<I", 4) + b"zstd" + struct.pack("<Q", len(packed)) + packed
    )
    data = whole.read_bytes()
    at = next(at for at, kind, _ in records(data) if kind == 6)
    (place / "bag.mcap").write_bytes(unsealed(data[:at] + struct.pack("<BQ", 6, len(body)) + body + data[at:]))


def sqlite(statements: str, messages: bool = True) -> Change:
    """A .db3 file as rosbag2 makes it, altered by SQL."""

    def make(whole: Path, place: Path) -> None:
        content = Content.of(whole)
        connection = sqlite3.connect(place / "bag.db3")
        connection.executescript(
            "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
            "INSERT INTO schema VALUES (4, 'jazzy');"
            "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER, metadata TEXT);"
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT,"
            " offered_qos_profiles TEXT, type_description_hash TEXT);"
            "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT,"
            " encoded_message_definition TEXT, type_description_hash TEXT);"
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);"
        )
        numbers = {topic: number for number, topic in enumerate(content.kinds, 1)}
        for topic, (name, encoding, text, form) in content.kinds.items():
            number = numbers[topic]
            connection.execute("INSERT INTO topics VALUES (?,?,?,?,'','')", (number, topic, name, form))
            row = (number, name, encoding, text.decode())
            connection.execute("INSERT INTO message_definitions VALUES (?,?,?,?,'')", row)
        rows = [(numbers[one.topic], one.time, one.data) for one in content.messages] if messages else []
        connection.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (?,?,?)", rows)
        connection.executescript(statements)
        connection.commit()
        connection.close()

    return make


def beside(text: bytes | Callable[[Path], object]) -> Change:
    """The whole file with another metadata.yaml, or what a function makes in its place."""

    def make(whole: Path, place: Path) -> None:
        shutil.copy(whole, place)
        target = place / "metadata.yaml"
        text(target) if callable(text) else target.write_bytes(text)

    return make


def only(make: Callable[[Path], object]) -> Change:
    """Something that is no file of a bag, by the name of one."""
    return lambda _, place: make(place / "bag.mcap") and None  # type: ignore[func-returns-value]


def lines(*statements: str) -> bytes:
    """A metadata.yaml of rosbag2 with these lines in it."""
    return "\n".join(("rosbag2_bagfile_information:", "  version: 9", *(f"  {each}" for each in statements))).encode()


FOREIGN = ("other/msg/Thing", "ros2msg", b"float64 value\n", "cdr")
NUMBER = b"\0\1\0\0" + struct.pack("<d", 1.0)


def many_topics(content: Content) -> None:
    """Two thousand topics of one message."""
    for number in range(2000):
        content.kinds[f"/other/topic{number}"] = FOREIGN
        content.messages.append(Message(f"/other/topic{number}", NUMBER, 0))


def doubled(content: Content) -> None:
    """Every message twice."""
    content.messages = [message for message in content.messages for _ in range(2)]


def two_runs(content: Content) -> None:
    """A second run of other numbers among the first."""
    second = [replace(one, data=doubles(0.5)(one.data)) if one.topic == TRUTH else one for one in content.messages]
    content.messages = [
        message for pair in zip(content.messages, second[5:] + second[:5], strict=True) for message in pair
    ]


def moved_file(content: Content) -> None:
    """An attachment whose name leads elsewhere."""
    content.attachments["../../../../tmp/formation_gnc_escaped"] = b"escaped"


DEEP = "[" * 2000 + "]" * 2000
MULTIPLYING = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "\n".join(
    f"{new}: &{new} [{','.join([f'*{old}'] * 9)}]" for old, new in zip("abcdefgh", "bcdefghi", strict=True)
)
INNER = b"formation_gnc_msgs/Loop inner\n"
NESTED = INNER + b"=" * 80 + b"\nMSG: formation_gnc_msgs/Loop\n" + INNER
TENFOLD = b"other/B[10] x\n" + b"".join(
    b"=" * 80 + f"\nMSG: other/{one}\n{'other/' + two + '[10]' if two else 'float64'} x\n".encode()
    for one, two in zip("BCDEFGHIJKLMN", [*"CDEFGHIJKLMN", ""], strict=True)
)

BELIEVED = (
    "truth that is not a number",
    "an infinite thrust",
    "a measurement altered, all checksums right",
    "an estimate of 1e300",
    "every message twice",
)
"""What is well formed, in bounds and with right checksums: its figures are those of what is in the file."""

BAGS: dict[str, Change] = {
    "a path that is not there": lambda _, place: place.rmdir(),
    "an empty directory": lambda *_: None,
    "a directory by the name of a file": only(Path.mkdir),
    "a file of no bytes": raw(lambda _: b""),
    "words": raw(lambda _: b"not a bag " * 100),
    "the first eight bytes alone": raw(lambda data: data[:8]),
    "random bytes behind the first eight": raw(lambda data: data[:8] + NOISE.randbytes(100_000)),
    "a named pipe": only(os.mkfifo),
    "a link to /dev/zero": only(lambda path: path.symlink_to("/dev/zero")),
    "a link to itself": only(lambda path: path.symlink_to(path)),
    "cut at two thirds": raw(lambda data: data[: len(data) * 2 // 3]),
    "cut by one byte": raw(lambda data: data[:-1]),
    "its last kilobytes zeros, as after a loss of power": raw(lambda data: data[:-6000] + bytes(6000)),
    "a hole of zeros": raw(lambda data: data[: len(data) // 2] + bytes(512) + data[len(data) // 2 + 512 :]),
    "a bit flipped in a chunk": in_chunk(lambda head: head.__setitem__(50, head[50] ^ 1), checksum=False),
    "a bit flipped in a chunk, checksum of the section gone": in_chunk(lambda head: head.__setitem__(60, head[60] ^ 1)),
    "a bit flipped in a recorded parameter": flipped(b"real_time_factor", 22),
    "a bit flipped in a definition of the index": flipped(b"# ", 3),
    "a bit flipped in the last index": raw(lambda data: data[:-200] + bytes([data[-200] ^ 1]) + data[-199:]),
    "a chunk that is to unpack to 2^60 bytes": in_chunk(
        lambda head: head.__setitem__(slice(16, 24), struct.pack("<Q", 2**60))
    ),
    "a chunk that unpacks to 2 GiB": bomb,
    "a chunk compressed in an unknown way": in_chunk(lambda head: head.__setitem__(slice(32, 36), b"lz5x")),
    "a record of 2^63 bytes": raw(lambda data: data[:9] + struct.pack("<Q", 2**63) + data[17:]),
    "a topic renamed in the index": resealed(lambda data: data.replace(b"/deputy1/target", b"/deputy1/tarGet")),
    "a message a byte short": each(THRUST, lambda data: data[:-1], every=10**6, after=3),
    "messages of no bytes": each(ESTIMATE, lambda _: b"", every=2),
    "messages of random bytes": each(ESTIMATE, lambda data: NOISE.randbytes(len(data))),
    "a name of 2^31 characters": each(TRUTH, lambda data: data[:12] + b"\xff\xff\xff\x7f" + data[16:]),
    "a list of 2^32 readings": each(MEASUREMENT, lambda data: data.replace(b"\3\0\0\0", b"\xff\xff\xff\xff")),
    "truth that is not a number": each(TRUTH, doubles(float("nan")), after=5),
    "an estimate of 1e300": each(ESTIMATE, doubles(1e300), every=3),
    "an infinite thrust": each(THRUST, doubles(float("inf")), every=4),
    "a measurement altered, all checksums right": each(MEASUREMENT, doubles(3.0), every=10**6, after=9),
    "times in 2038": restamped(lambda _, second: 2**31 - 20 + second),
    "times before 0": restamped(lambda _, second: -5 - second),
    "times that run back": restamped(lambda _, second: 30 - second),
    "times at random": restamped(lambda row, _: row * 7919 % 100),
    "one message in 2038": restamped(lambda row, second: 2**31 - 1 if row == 200 else second),
    "every message twice": rewritten(doubled),
    "two runs mixed": rewritten(two_runs),
    "no truth": without(TRUTH),
    "no measurements": without(MEASUREMENT),
    "thirty ticks without estimate": without(ESTIMATE, slice(10, 40)),
    "another type for the thrust": typed(THRUST, "std_msgs/msg/String", "ros2msg", b"string data\n", "cdr"),
    "no schema for the truth": typed(TRUTH, "", "", b"", "cdr"),
    "a schema of random bytes": typed(TRUTH, "formation_gnc_msgs/msg/Truth", "ros2msg", NOISE.randbytes(2000), "cdr"),
    "a schema that contains itself": typed(TRUTH, "formation_gnc_msgs/msg/Loop", "ros2msg", NESTED, "cdr"),
    "a schema with an array of 2^40 numbers": typed(
        ESTIMATE, FOREIGN[0], "ros2msg", b"float64[1099511627776] x\n", "cdr"
    ),
    "a schema nested thirteen times tenfold": typed(ESTIMATE, "other/msg/A", "ros2msg", TENFOLD, "cdr"),
    "Protobuf": typed(TRUTH, "other.Message", "protobuf", b"\x0a\x01", "protobuf"),
    "lost counts that are no numbers": metadata("lost messages", lambda _: {TRUTH: "many", ESTIMATE: "-3"}),
    "parameters nested two thousand deep": metadata("parameters", lambda old: dict.fromkeys(old, DEEP)),
    "parameters of aliases that multiply": metadata("parameters", lambda old: dict.fromkeys(old, MULTIPLYING)),
    "parameters beyond all bounds": metadata(
        "parameters", lambda old: old | {"tick": "1e308", "chief.eccentricity": "7"}
    ),
    "an attachment whose name leads elsewhere": rewritten(moved_file),
    "a topic named in HTML and escapes": added("/<script>alert(1)</script>\x1b[31m\n[red]", FOREIGN, NUMBER),
    "a topic that leads elsewhere": added("/../../../tmp/formation_gnc_escaped", FOREIGN, NUMBER),
    "two thousand topics": rewritten(many_topics),
    "metadata.yaml of aliases that multiply": beside(MULTIPLYING.encode()),
    "metadata.yaml that contains itself": beside(b"&a {rosbag2_bagfile_information: *a}"),
    "metadata.yaml that is no text": beside(NOISE.randbytes(1000)),
    "metadata.yaml that is a directory": beside(Path.mkdir),
    "metadata.yaml that is a named pipe": beside(os.mkfifo),
    "metadata.yaml that lists a file that is not there": beside(lines("relative_file_paths: [bag.mcap, gone.mcap]")),
    "metadata.yaml that lists files elsewhere": beside(lines("relative_file_paths: [../../../etc/passwd]")),
    "metadata.yaml of messages packed one by one": beside(lines("compression_mode: MESSAGE")),
    "a sqlite3 bag of a header alone": lambda _, place: (place / "bag.db3").write_bytes(b"SQLite format 3\0") and None,
    "a sqlite3 bag without tables": sqlite("DROP TABLE messages; DROP TABLE topics"),
    "a sqlite3 bag whose messages are an endless view": sqlite(
        "DROP TABLE messages; CREATE VIEW messages AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)"
        " SELECT i AS id, 1 AS topic_id, i AS timestamp, x'00010000' AS data FROM n",
        messages=False,
    ),
    "a sqlite3 bag with words for data and times": sqlite(
        "UPDATE messages SET data = 'x', timestamp = 'noon' WHERE id % 7 = 0"
    ),
    "a sqlite3 bag of messages of no topic": sqlite("UPDATE messages SET topic_id = 99 WHERE id % 3 = 0"),
}
"""What is made, by what it is."""


def make(name: str, whole: Path, place: Path) -> Path:
    """Make a hostile bag in a directory; returns the path to give to a command."""
    place.mkdir(parents=True)
    BAGS[name](whole, place)
    return place
