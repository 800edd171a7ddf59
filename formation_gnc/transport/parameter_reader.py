"""Reads the parameters of other nodes through the standard services."""

from collections.abc import Callable, Mapping
from typing import Any

from rcl_interfaces.msg import ParameterType
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.task import Future


class ParameterReader:
    """Asks nodes for all their parameters, without waiting for the answer."""

    def __init__(self, node: Node) -> None:
        """Ask as a node."""
        self._node = node
        self._clients: dict[str, AsyncParameterClient] = {}

    def nodes(self) -> list[str]:
        """Full names of the nodes that can be asked."""
        services = (service.rpartition("/") for service, _ in self._node.get_service_names_and_types())
        return [node for node, _, kind in services if kind == "get_parameters"]

    def ask(self, node: str, take: Callable[[Mapping[str, Any]], None]) -> bool:
        """Ask a node, and let `take` have its parameters by name; returns whether its services are ready.

        A node that gives no value for some of its parameters gives none: it has to be asked again.
        """
        if node not in self._clients:
            self._clients[node] = AsyncParameterClient(self._node, node)
        client = self._clients[node]
        if not client.services_are_ready():
            return False

        def on_list(answer: Future) -> None:
            names = list(answer.result().result.names)
            client.get_parameters(names, callback=lambda values: on_values(names, values))

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

        client.list_parameters(callback=on_list)
        return True
