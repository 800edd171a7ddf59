"""Reads the parameters of other nodes through the standard services."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.task import Future


class ParameterReader:
    """Asks nodes for all their parameters, without waiting for the answer.

    It has no client of a service that changes anything, as rclpy's own has, and needs no permission to.
    """

    def __init__(self, node: Node) -> None:
        """Ask as a node."""
        self._node = node
        self._clients: dict[str, tuple[Client, Client]] = {}

    def nodes(self) -> list[str]:
        """Full names of the nodes that can be asked."""
        services = (service.rpartition("/") for service, _ in self._node.get_service_names_and_types())
        return [node for node, _, kind in services if kind == "get_parameters"]

    def ask(self, node: str, take: Callable[[Mapping[str, Any]], None]) -> bool:
        """Ask a node, and let `take` have its parameters by name; returns whether its services are ready.

        A node that gives no value for some of its parameters gives none: it has to be asked again.
        """
        if node not in self._clients:
            self._clients[node] = (
                self._node.create_client(ListParameters, f"{node}/list_parameters"),
                self._node.create_client(GetParameters, f"{node}/get_parameters"),
            )
        listing, getting = self._clients[node]
        if not (listing.service_is_ready() and getting.service_is_ready()):
            return False

        def on_list(answer: Future) -> None:
            names = list(answer.result().result.names)
            getting.call_async(GetParameters.Request(names=names)).add_done_callback(partial(on_values, names))

        def on_values(names: list[str], answer: Future) -> None:
            values = answer.result().values
            if len(values) != len(names):  # one of them has no value, or has gone
                return
            take(
                {
                    name: parameter_value_to_python(value)
                    for name, value in zip(names, values, strict=True)
                    if ParameterType.PARAMETER_NOT_SET < value.type <= ParameterType.PARAMETER_STRING_ARRAY
                }
            )

        listing.call_async(ListParameters.Request()).add_done_callback(on_list)
        return True
