"""Subscriptions that know the publisher of each message, which rclpy of Jazzy leaves out of what it hands on."""

import ctypes
import struct
from collections.abc import Callable
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.type_support import check_is_valid_msg_type
from rclpy.waitable import NumberOfEntities, Waitable

from formation_gnc.flight.reception import Information

BURST = 100
"""Messages taken at once; then timers have their turn, whoever floods the topic."""

UNNUMBERED = 2**64 - 1
"""Sequence number of a middleware that has none."""

_TAKEN = 0
_NONE_THERE = 401  # RCL_RET_SUBSCRIPTION_TAKE_FAILED


class _Allocator(ctypes.Structure):
    """rcutils_allocator_t."""

    _fields_ = [(name, ctypes.c_void_p) for name in ("allocate", "free", "reallocate", "allocate_zeroed", "state")]


class _Buffer(ctypes.Structure):
    """rcutils_uint8_array_t; the middleware lengthens it as it needs."""

    _fields_ = [
        ("data", ctypes.c_void_p),
        ("length", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
        ("allocator", _Allocator),
    ]


class _MessageInfo(ctypes.Structure):
    """rmw_message_info_t."""

    _fields_ = [
        ("source_timestamp", ctypes.c_int64),
        ("received_timestamp", ctypes.c_int64),
        ("publication_sequence_number", ctypes.c_uint64),
        ("reception_sequence_number", ctypes.c_uint64),
        ("implementation", ctypes.c_char_p),
        ("publisher", ctypes.c_uint8 * 16),
        ("from_intra_process", ctypes.c_bool),
    ]


_INFORMATION = struct.Struct("@q8xQ16x16s")
"""Of _MessageInfo: source timestamp, publication sequence number, publisher."""

_rcl, _rcutils = ctypes.CDLL("librcl.so"), ctypes.CDLL("librcutils.so")
_take = _rcl.rcl_take_serialized_message
_take.argtypes = [ctypes.c_void_p] * 4
_notify = _rcl.rcl_subscription_set_on_new_message_callback
_notify.argtypes = [ctypes.c_void_p] * 3
_default_allocator = _rcutils.rcutils_get_default_allocator
_default_allocator.restype = _Allocator
_release = _rcutils.rcutils_uint8_array_fini
_release.argtypes = [ctypes.c_void_p]


class IdentifiedSubscription(Waitable):  # type: ignore[misc]
    """Calls back with the CDR bytes of a topic's messages, and with what is known of each.

    A waitable, since rclpy's own subscriptions are taken from by rclpy. It does its work where it is asked whether
    there is any: the task that rclpy makes of it otherwise takes longer than the message itself.
    """

    def __init__(
        self,
        node: Node,
        kind: Any,
        topic: str,
        callback: Callable[[bytes, Information], object],
        profile: QoSProfile,
        events: SubscriptionEventCallbacks,
    ) -> None:
        """Subscribe a node to a topic of a message class."""
        super().__init__(node.default_callback_group)
        check_is_valid_msg_type(kind)
        with node.handle:
            self.handle = rclpy_implementation.Subscription(node.handle, kind, topic, profile.get_c_qos_profile())
        self._node, self._callback, self._is_silent = node, callback, False
        self._buffer, self._info = _Buffer(allocator=_default_allocator()), _MessageInfo()
        addresses = self.handle.pointer, ctypes.addressof(self._buffer), ctypes.addressof(self._info)
        self._arguments = *map(ctypes.c_void_p, addresses), None
        self._waitables = [self, *events.create_event_handlers(node.default_callback_group, self.handle, topic)]
        for each in self._waitables:
            node.add_waitable(each)

    def take(self) -> tuple[bytes, Information] | None:
        """The next message; None when there is none."""
        result = _take(*self._arguments)
        if result != _TAKEN:
            if result != _NONE_THERE:
                self._node.get_logger().warning(f"a message was not given by the middleware: error {result}", once=True)
            return None
        published, number, publisher = _INFORMATION.unpack_from(self._info)
        return ctypes.string_at(self._buffer.data, self._buffer.length), {
            "publisher": publisher,
            "source_timestamp": published,
            "publication_sequence_number": None if number == UNNUMBERED else number,
        }

    def is_ready(self, _wait_set: Any) -> bool:
        """Take what is there, though the executor asks once for each message.

        It asks slowly: a stranger's burst would push out of the queue what is awaited, and a message that nobody
        was told of would wait for the next one, which in lock-step waits for it.
        """
        for _ in range(0 if self._is_silent else BURST):
            message = self.take()
            if message is None:
                break
            self._callback(*message)
        return False

    def get_num_entities(self) -> NumberOfEntities:
        """One subscription."""
        return NumberOfEntities(1, 0, 0, 0, 0, 0)

    def add_to_wait_set(self, wait_set: Any) -> None:
        """Wait for messages."""
        wait_set.add_subscription(self.handle)

    def take_data(self) -> None:
        """Nothing is left for a task."""

    async def execute(self, taken_data: Any) -> None:
        """Nothing is left for a task."""

    def silence(self) -> None:
        """Take no more messages.

        To come before `destroy`, with the executor at work in between: a message that it has noticed and not asked for
        would have it end what is destroyed without the interpreter's lock, and crash.
        """
        self._is_silent = True
        _notify(self.handle.pointer, None, None)

    def destroy(self) -> None:
        """Unsubscribe; after `silence`."""
        for each in self._waitables:
            self._node.remove_waitable(each)
        for handler in self._waitables[1:]:
            handler.destroy()
        self.handle.destroy_when_not_in_use()

    def __enter__(self) -> None:
        """Keep the middleware's part alive."""
        self.handle.__enter__()

    def __exit__(self, *error: object) -> None:
        """Let it go."""
        self.handle.__exit__(*error)

    def __del__(self) -> None:
        """Give the buffer back."""
        _release(ctypes.addressof(self._buffer))


def unsubscribe(node: Node, executor: Any = None) -> None:
    """Destroy all identified subscriptions of a node, which rclpy leaves alone; `executor`: the one that serves it."""
    subscriptions = [each for each in node.waitables if isinstance(each, IdentifiedSubscription)]
    for each in subscriptions:
        each.silence()
    if executor is not None:
        executor.spin_once(timeout_sec=0.0)
    for each in subscriptions:
        each.destroy()


def identities(node: Node, topic: str) -> dict[bytes, str]:
    """Full names of the nodes that publish a topic, by the identities of their publishers."""
    return {
        bytes(each.endpoint_gid): f"{each.node_namespace.rstrip('/')}/{each.node_name}"
        for each in node.get_publishers_info_by_topic(topic)
    }
