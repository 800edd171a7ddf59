"""Subscriptions that know the publisher of each message, which rclpy of Jazzy leaves out of what it hands on.

They are not rclpy's, and no executor of it serves them: its task for each message takes longer than the message
itself. The middleware counts what comes on an event descriptor of the system, without the interpreter, and who serves
the node polls those (:class:`Inbox`).
"""

import ctypes
import os
import struct
from collections.abc import Callable
from contextlib import suppress
from select import EPOLLIN, epoll
from typing import Any
from weakref import WeakKeyDictionary

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.type_support import check_is_valid_msg_type

from formation_gnc.flight.reception import Information

BURST = 100
"""Messages taken at once; then other topics and timers have their turn, whoever floods this one."""

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
_count = ctypes.cast(ctypes.CDLL(None).eventfd_write, ctypes.c_void_p)
"""Called by the middleware with what it was given, the descriptor, and the number of new messages."""
_default_allocator = _rcutils.rcutils_get_default_allocator
_default_allocator.restype = _Allocator
_release = _rcutils.rcutils_uint8_array_fini
_release.argtypes = [ctypes.c_void_p]


class IdentifiedSubscription:
    """Calls back with the CDR bytes of a topic's messages, and with what is known of each."""

    def __init__(
        self,
        node: Node,
        kind: Any,
        topic: str,
        callback: Callable[[bytes, Information], object],
        profile: QoSProfile,
        events: SubscriptionEventCallbacks,
    ) -> None:
        """Subscribe a node to a topic of a message class; its messages are in the node's inbox."""
        check_is_valid_msg_type(kind)
        with node.handle:
            self._handle = rclpy_implementation.Subscription(node.handle, kind, topic, profile.get_c_qos_profile())
        self._node, self._callback = node, callback
        self._buffer, self._info = _Buffer(allocator=_default_allocator()), _MessageInfo()
        addresses = self._handle.pointer, ctypes.addressof(self._buffer), ctypes.addressof(self._info)
        self._arguments = *map(ctypes.c_void_p, addresses), None
        self._events = events.create_event_handlers(node.default_callback_group, self._handle, topic)
        for each in self._events:
            node.add_waitable(each)
        self._new = os.eventfd(0, os.EFD_CLOEXEC | os.EFD_NONBLOCK)
        inbox_of(node).add(self)
        _notify(self._handle.pointer, _count, self._new)

    def fileno(self) -> int:
        """The descriptor that is readable while messages wait."""
        return self._new

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

    def receive(self) -> None:
        """Take the messages that were counted, or the first of them."""
        count = 0
        with suppress(BlockingIOError):  # a look was faster
            count = os.eventfd_read(self._new)
        if count > BURST:
            os.eventfd_write(self._new, count - BURST)
        self._receive(min(count, BURST))

    def look(self) -> None:
        """Take what is there, counted or not: in lock-step a message that nobody was told of is waited for."""
        self._receive(BURST)

    def _receive(self, count: int) -> None:
        for _ in range(count):
            message = self.take()
            if message is None:
                break
            self._callback(*message)

    def destroy(self) -> None:
        """Unsubscribe."""
        _notify(self._handle.pointer, None, None)
        for each in self._events:
            self._node.remove_waitable(each)
            each.destroy()
        self._handle.destroy_when_not_in_use()
        inbox_of(self._node).remove(self)
        os.close(self._new)

    def __del__(self) -> None:
        """Give the buffer back."""
        _release(ctypes.addressof(self._buffer))


class Inbox:
    """The messages that wait in a node's identified subscriptions."""

    def __init__(self) -> None:
        """No subscriptions."""
        self._poll = epoll()
        self._subscriptions: dict[int, IdentifiedSubscription] = {}

    def fileno(self) -> int:
        """The descriptor that is readable while messages wait."""
        return self._poll.fileno()

    def add(self, subscription: IdentifiedSubscription) -> None:
        """Receive a subscription's messages from now on."""
        self._subscriptions[subscription.fileno()] = subscription
        self._poll.register(subscription, EPOLLIN)

    def remove(self, subscription: IdentifiedSubscription) -> None:
        """Receive them no longer."""
        del self._subscriptions[subscription.fileno()]
        self._poll.unregister(subscription)

    def receive(self) -> None:
        """Receive messages that wait, a burst of each topic at most."""
        for descriptor, _ in self._poll.poll(0):
            if descriptor in self._subscriptions:  # not destroyed by what came before
                self._subscriptions[descriptor].receive()

    def look(self) -> None:
        """Receive what nobody was told of as well."""
        for each in list(self._subscriptions.values()):
            each.look()

    def clear(self) -> None:
        """Destroy all subscriptions, which rclpy leaves alone."""
        for each in list(self._subscriptions.values()):
            each.destroy()


_inboxes: WeakKeyDictionary[Node, Inbox] = WeakKeyDictionary()


def inbox_of(node: Node) -> Inbox:
    """The inbox of a node, made when it is first asked for."""
    if node not in _inboxes:
        _inboxes[node] = Inbox()
    return _inboxes[node]


def identities(node: Node, topic: str) -> dict[bytes, str]:
    """Full names of the nodes that publish a topic, by the identities of their publishers."""
    return {
        bytes(each.endpoint_gid): f"{each.node_namespace.rstrip('/')}/{each.node_name}"
        for each in node.get_publishers_info_by_topic(topic)
    }
