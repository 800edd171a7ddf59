"""Reader of one file of rosbag2's sqlite3 storage, through rosbags."""

from collections.abc import Callable, Collection, Iterator
from pathlib import Path

from mcap.records import Channel, Schema
from rosbags.interfaces import Connection, ConnectionExtRosbag2, MessageDefinitionFormat
from rosbags.rosbag2 import Reader

from formation_gnc.errors import BagError
from formation_gnc.recording.stored_file import Span, StoredFile

_ENCODINGS = {
    MessageDefinitionFormat.MSG: "ros2msg",
    MessageDefinitionFormat.IDL: "ros2idl",
}


class SqliteFile(StoredFile):
    """One .db3 file.

    Raises:
        BagError: the file cannot be read, or is none of rosbag2's.
    """

    def __init__(self, path: Path, unpack: Callable[[bytes], bytes] | None = None) -> None:
        """Scan the file."""
        super().__init__(path, unpack)
        try:
            with Reader(path) as reader:
                for connection in reader.connections:
                    self._define(*_definition(connection))
                span = self._begin_span(0)
                for connection, time, data in reader.messages():
                    self._note(span, connection.id, data, time)
        except Exception as error:  # whatever its database library raises
            raise self._unreadable(error) from None

    def _span_records(self, span: Span, channels: Collection[int]) -> Iterator[tuple[int, bytes, int]]:
        try:
            with Reader(self.path) as reader:
                wanted = [each for each in reader.connections if each.id in channels]
                for connection, _, data in reader.messages(wanted) if wanted else ():
                    yield connection.id, self._unpack(data), 0
        except BagError:
            raise
        except Exception as error:
            raise self._unreadable(error) from None

    def _unreadable(self, error: Exception) -> BagError:
        return BagError(f"{self.path}: cannot be read as a sqlite3 bag ({error or type(error).__name__})")


def _definition(connection: Connection) -> tuple[Schema, Channel]:
    """Definition of a topic as an MCAP file has it."""
    encoding = _ENCODINGS.get(connection.msgdef.format, "")
    schema = Schema(connection.id, connection.msgdef.data.encode() if encoding else b"", encoding, connection.msgtype)
    form = connection.ext.serialization_format if isinstance(connection.ext, ConnectionExtRosbag2) else "cdr"
    return schema, Channel(connection.id, connection.topic, form, {}, connection.id)
