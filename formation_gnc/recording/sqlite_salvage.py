"""Readable records of a sqlite3 bag file that was cut or damaged anywhere."""

import shutil
import sqlite3
import struct
import tempfile
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

from mcap.records import Channel, Message, Schema

from formation_gnc.recording.salvage import Group

_ROWS = 1000
"""Rows that are read at once; where they cannot be, they are halved until the damage is found."""

_GIVEN_UP = 20 * _ROWS
"""Rows that cannot be read on end after which none is looked for, where the number of the last is lost too."""

_HEADER = struct.Struct(">16xH10xI")
"""Size and number of pages in the header of a file; a size of 1 is 65536 bytes."""

_MOST_FILLED = 1 << 30
"""Bytes that a file may lack; a damaged header asks for more."""

_FILLING = 1 << 20
"""Bytes that are filled up at a time."""

_TOPICS = "SELECT id, name, type, serialization_format, offered_qos_profiles FROM topics"
_DEFINITIONS = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
_LAST = "SELECT max(id) FROM messages"
_MESSAGES = "SELECT id, topic_id, timestamp, data FROM messages WHERE id BETWEEN ? AND ? ORDER BY id"


class SqliteSalvage:
    """Reads the rows of a file in the order in which they were written, and skips what is damaged.

    Attributes:
        reasons: what is damaged, one line each; complete once all records were read.
    """

    has_wrong_lengths = False

    def __init__(self, path: Path) -> None:
        """Read the file at a path; nothing is written beside it."""
        self.path, self.reasons = path, list[str]()
        self._lost: list[int] = []

    def records(self) -> Iterator[Group]:
        """Definitions, then messages, each group of what was read at once."""
        self.reasons, self._lost = [], []
        with tempfile.TemporaryDirectory(prefix="formation_gnc-") as directory:
            file, *others = self._files(Path(directory))
            with _opened(file) as database, _opened(others[0] if others else file) as witness:
                yield Group(self._definitions(database))
                for group in self._all_messages(database):
                    yield self._confirmed(group, witness) if others else group
        if self._lost:
            self.reasons.append(f"{self.path}: messages cannot be read, the first of them number {min(self._lost)}")

    def _files(self, directory: Path) -> list[Path]:
        """The file; of one that is cut, two copies with what is missing filled up, by zeros and by ones.

        sqlite reads nothing of a cut file. What is equal in both copies was there.
        """
        with self.path.open("rb") as stream:
            header = stream.read(_HEADER.size)
        page, pages = _HEADER.unpack(header) if len(header) == _HEADER.size else (0, 0)
        missing = (page if page > 1 else 1 << 16) * pages - self.path.stat().st_size
        if not 0 < missing < _MOST_FILLED:
            return [self.path]
        self.reasons.append(f"{self.path}: cut: {missing} bytes are missing")
        copies = [directory / "zeros.db3", directory / "ones.db3"]
        for copy, byte in zip(copies, (b"\0", b"\xff"), strict=True):
            shutil.copyfile(self.path, copy)
            with copy.open("ab") as stream:
                for _ in range(0, missing, _FILLING):
                    stream.write(byte * min(_FILLING, missing))
        return copies

    def _confirmed(self, group: Group, witness: sqlite3.Connection) -> Group:
        """The messages of a group that a second copy has too; definitions are kept as they are."""
        numbers = [each.sequence for each in group.records if isinstance(each, Message)]
        if not numbers:
            return group
        same = {each for part in self._messages(witness, numbers[0], numbers[-1]) for each in map(_key, part.records)}
        kept = [each for each in group.records if _key(each) in same]
        self._lost += [each.sequence for each in group.records if isinstance(each, Message) and _key(each) not in same]
        return Group(kept)

    def _all_messages(self, database: sqlite3.Connection) -> Iterator[Group]:
        last = self._rows(database, _LAST)
        end = last[0][0] or 0 if last else self.path.stat().st_size  # a row has at least a byte
        latest = 0
        for start in range(1, end + 1, _ROWS):
            for group in self._messages(database, start, min(start + _ROWS - 1, end)):
                latest = start if group.records else latest
                yield group
            if not last and start - latest > _GIVEN_UP:
                return

    def _definitions(self, database: sqlite3.Connection) -> list[Message | Schema | Channel]:
        texts = {kind: (str(encoding), str(text)) for kind, encoding, text in self._rows(database, _DEFINITIONS, False)}
        records = list[Message | Schema | Channel]()
        for number, name, kind, encoding, qos in self._rows(database, _TOPICS):
            form, text = texts.get(kind, ("", ""))
            records.append(Schema(number, text.encode(), form, str(kind)))
            metadata = {"offered_qos_profiles": str(qos)} if qos else {}
            records.append(Channel(number, str(name), str(encoding), metadata, number))
        return records

    def _messages(self, database: sqlite3.Connection, first: int, last: int) -> Iterator[Group]:
        try:
            rows = database.execute(_MESSAGES, (first, last)).fetchall()
        except sqlite3.Error:
            if first == last:
                self._lost.append(first)
                return
            middle = (first + last) // 2
            yield from self._messages(database, first, middle)
            yield from self._messages(database, middle + 1, last)
            return
        yield Group(
            [
                Message(topic, max(0, stamp), bytes(data), max(0, stamp), number & 0xFFFFFFFF)
                for number, topic, stamp, data in rows
                if isinstance(data, bytes) and isinstance(stamp, int) and isinstance(topic, int)
            ]
        )

    def _rows(self, database: sqlite3.Connection, query: str, is_needed: bool = True) -> list[Any]:
        try:
            return database.execute(query).fetchall()
        except sqlite3.Error as error:
            if is_needed:
                self.reasons.append(f"{self.path}: {error}")
            return []


def _opened(path: Path) -> closing[sqlite3.Connection]:
    return closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True))


def _key(record: Message | Schema | Channel) -> tuple[int, int, bytes] | None:
    return (record.sequence, record.channel_id, record.data) if isinstance(record, Message) else None
