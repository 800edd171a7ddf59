"""Definition of a topic as a bag carries it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Self

import yaml
from mcap.records import Channel, Schema

from formation_gnc.errors import BagError
from formation_gnc.limited_yaml import load_limited
from formation_gnc.messages.definitions import schema_text, type_hash

_INFINITE = "{sec: 9223372036, nsec: 854775807}"
_OFFERED_QOS = f"""\
- history: keep_last
  depth: %d
  reliability: reliable
  durability: transient_local
  deadline: {_INFINITE}
  lifespan: {_INFINITE}
  liveliness: automatic
  liveliness_lease_duration: {_INFINITE}
  avoid_ros_namespace_conventions: false
"""


@dataclass(frozen=True)
class TopicDefinition:
    """Message type of a topic, the type's definition, and rosbag2's channel metadata.

    All of the schema is empty where there is none, as JSON may do without.
    """

    type_name: str
    schema: bytes
    schema_encoding: str = "ros2msg"
    message_encoding: str = "cdr"
    metadata: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def recorded(cls, schema: Schema | None, channel: Channel) -> Self:
        """Definition by an MCAP file's records; QoS profiles that are no YAML are left out."""
        metadata = dict(channel.metadata)
        try:
            qos_profiles(metadata)
        except yaml.YAMLError:
            del metadata["offered_qos_profiles"]
        name, text, encoding = (schema.name, schema.data, schema.encoding) if schema else ("", b"", "")
        return cls(name, text, encoding, channel.message_encoding, metadata)

    @classmethod
    def installed(cls, type_name: str, depth: int) -> Self:
        """Definition as it is shipped or installed, offered reliable, transient-local, keep-last.

        Args:
            type_name: such as "std_msgs/msg/Header".
            depth: of the publisher's queue.

        Raises:
            BagError: the type is neither shipped nor installed, or the depth is not positive.
        """
        if depth < 1:
            raise BagError(f"queue depth {depth} is not allowed; it must be at least 1")
        metadata = {"offered_qos_profiles": _OFFERED_QOS % depth, "topic_type_hash": type_hash(type_name)}
        return cls(type_name, schema_text(type_name).encode(), metadata=metadata)


def qos_profiles(metadata: Mapping[str, str]) -> Any:
    """The QoS profiles of a channel's metadata, not to be changed; raises yaml.YAMLError for what is no YAML."""
    return _parsed(metadata.get("offered_qos_profiles", "[]"))


_parsed = lru_cache(maxsize=64)(load_limited)  # thousands of topics have the same few
