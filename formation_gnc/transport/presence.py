"""Whether a process of this machine lives, told by the kernel at once: DDS takes 20 s to forget one that was killed."""

import errno
import socket

from rclpy.node import Node


def _address(node: Node, name: str) -> str:
    """An address of Linux's abstract namespace: it leaves nothing behind, however its process ends."""
    return f"\0formation_gnc {node.context.get_domain_id()} {name}"


def announce(node: Node) -> socket.socket | None:
    """Show that this process lives, as a node's, until what is returned is closed; None where another shows it."""
    presence = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        presence.bind(_address(node, node.get_fully_qualified_name()))
    except OSError:
        presence.close()
        return None
    return presence


class Presence:
    """Watches nodes that announce themselves."""

    def __init__(self, node: Node) -> None:
        """Nobody has been seen."""
        self._node, self._seen = node, set[str]()

    def is_gone(self, name: str) -> bool:
        """Whether the process of a node of this full name has been seen and is gone; False for one elsewhere."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as probe:
            result = probe.connect_ex(_address(self._node, name))
        if result == 0:
            self._seen.add(name)
        return result == errno.ECONNREFUSED and name in self._seen
