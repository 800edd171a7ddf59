"""A message is its `.msg` file and its record, which names it: nothing else knows of it."""

from dataclasses import dataclass
from typing import ClassVar

from diagnostic_msgs.msg import KeyValue as KeyValueMessage
from rclpy.serialization import deserialize_message, serialize_message

from formation_gnc.messages.conversion import from_cdr, to_cdr, type_name
from formation_gnc.records import Record
from formation_gnc.transport.message_types import message_type

# An installed message stands for a new file in msg_defs/msg: `string key`, `string value`.


@dataclass(slots=True)
class KeyValue(Record):
    """The record of it."""

    message: ClassVar = "diagnostic_msgs/KeyValue"

    key: str
    value: str


RECORD = KeyValue("tank pressure", "2.4 MPa")


def test_ros_reads_what_the_record_becomes() -> None:
    assert type_name(KeyValue) == "diagnostic_msgs/msg/KeyValue"
    assert message_type(KeyValue) is KeyValueMessage
    assert deserialize_message(to_cdr(RECORD), KeyValueMessage) == KeyValueMessage(key=RECORD.key, value=RECORD.value)


def test_the_record_is_read_from_what_ros_writes() -> None:
    written = serialize_message(KeyValueMessage(key=RECORD.key, value=RECORD.value))
    assert from_cdr(KeyValue, written) == RECORD
