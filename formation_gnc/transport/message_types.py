"""Classes of messages, from the packages that ROS has installed."""

from importlib import import_module
from typing import Any

from formation_gnc.errors import ConfigurationError
from formation_gnc.messages.conversion import type_name
from formation_gnc.records import Record


def message_type(record_type: type[Record]) -> Any:
    """Class of the message that a record mirrors."""
    return message_class(type_name(record_type))


def message_class(type_name: str) -> Any:
    """The class of a message type such as ``std_msgs/msg/String``; raises ConfigurationError for none."""
    try:
        package, kind, name = type_name.split("/")
        return getattr(import_module(f"{package}.{kind}"), name)
    except (ImportError, AttributeError, ValueError):
        raise ConfigurationError(f"message type {type_name!r} is not installed") from None
