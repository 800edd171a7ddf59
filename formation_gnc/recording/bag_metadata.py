"""Description of a bag in rosbag2's YAML, which stands in metadata.yaml and in each finished file."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import yaml

from formation_gnc.recording.topic_definition import TopicDefinition

EMPTY_START = 2**63 - 1
"""Starting time (ns) that rosbag2 gives a bag without messages."""


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]
    """Writes what several topics share out for each of them, as rosbag2 does."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


@dataclass
class TopicEntry:
    """A topic of a bag."""

    definition: TopicDefinition
    qos: Any
    """The QoS profiles offered, as parsed YAML."""
    count: int = 0
    """Number of messages."""


@dataclass
class FileEntry:
    """A file of a bag."""

    name: str
    count: int = 0
    """Number of messages."""
    start: int = EMPTY_START
    """First stamp, ns."""
    end: int = 0
    """Last stamp, ns."""


def bag_information(topics: Mapping[str, TopicEntry], files: Sequence[FileEntry]) -> str:
    """The description, YAML, of a bag with these topics, by name, and files."""
    described_topics = [
        {
            "topic_metadata": {
                "name": name,
                "type": topic.definition.type_name,
                "serialization_format": topic.definition.message_encoding,
                "offered_qos_profiles": topic.qos,
                "type_description_hash": topic.definition.metadata.get("topic_type_hash", ""),
            },
            "message_count": topic.count,
        }
        for name, topic in topics.items()
    ]
    information = {
        "version": 9,
        "storage_identifier": "mcap",
        **_span(files),
        "message_count": sum(file.count for file in files),
        "topics_with_message_count": described_topics,
        "compression_format": "",  # of whole files: MCAP compresses its chunks itself
        "compression_mode": "",
        "relative_file_paths": [file.name for file in files],
        "files": [{"path": file.name, **_span([file]), "message_count": file.count} for file in files],
        "custom_data": None,
        "ros_distro": "jazzy",
    }
    return str(yaml.dump(information, Dumper=_Dumper, sort_keys=False))


def _span(files: Collection[FileEntry]) -> dict[str, dict[str, int]]:
    start = min(file.start for file in files)
    end = max(file.end for file in files)
    return {
        "starting_time": {"nanoseconds_since_epoch": start},
        "duration": {"nanoseconds": max(end - start, 0)},
    }
