"""Sets parameters of a running node through the standard services."""

from collections.abc import Mapping
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.task import Future

from formation_gnc.errors import ConfigurationError, nearest

PATIENCE = 10.0
"""Wall time (s) that a node has to be discovered, and to answer."""


def set_parameters(name: str, values: Mapping[str, Any], domain: int | None = None, patience: float = PATIENCE) -> None:
    """Set parameters of a node, all or none.

    Args:
        name: full name of the node.
        values: by parameter; a whole number is a double where the parameter is one.
        domain: of ROS; None for that of the environment.
        patience: wall time (s) that the node has to be discovered, and for each answer.

    Raises:
        ConfigurationError: no such node, a value of another type, or the node rejects the change.
    """
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    node = rclpy.create_node("set", context=context, start_parameter_services=False)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def wait(answer: Future) -> Any:
        executor.spin_until_future_complete(answer, timeout_sec=patience)
        if not answer.done():
            raise ConfigurationError(f"node {name}: does not answer within {patience:g} s")
        return answer.result()

    try:
        client = AsyncParameterClient(node, name)
        if not client.wait_for_services(timeout_sec=patience):
            raise ConfigurationError(f"node {name}: not in this ROS domain; {_hint(node, name)}")
        types = wait(client.get_parameter_types(list(values))).types
        if len(types) < len(values):  # ROS leaves the types out when one name is unknown
            known = wait(client.list_parameters()).result.names
            unknown = next(each for each in values if each not in known)
            raise ConfigurationError(f"node {name}: parameter {unknown}: unknown; {nearest(unknown, known)}")
        parameters = [_parameter(*item, Parameter.Type(kind)) for item, kind in zip(values.items(), types, strict=True)]
        result = wait(client.set_parameters_atomically(parameters)).result
        if not result.successful:
            raise ConfigurationError(f"node {name}: {result.reason}")
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


def _parameter(name: str, value: Any, kind: Parameter.Type) -> Parameter:
    # rclpy takes an empty array for one of bytes.
    if kind in (Parameter.Type.NOT_SET, Parameter.Type.BYTE_ARRAY):
        return Parameter(name, value=value)
    if kind == Parameter.Type.DOUBLE and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if kind == Parameter.Type.DOUBLE_ARRAY and isinstance(value, list):
        value = [float(each) if isinstance(each, int) and not isinstance(each, bool) else each for each in value]
    try:
        return Parameter(name, kind, value)
    except (ValueError, TypeError):
        allowed = kind.name.lower().replace("_", " ")
        raise ConfigurationError(f"parameter {name}: {value!r} is not allowed; it must be of type {allowed}") from None


def _hint(node: Node, name: str) -> str:
    """The nearest name of a node that is there, or all of them."""
    names = (f"{namespace.rstrip('/')}/{each}" for each, namespace in node.get_node_names_and_namespaces())
    known = sorted({*names} - {node.get_fully_qualified_name()})
    return nearest(name, known) if known else "it has no node; set ROS_DOMAIN_ID to that of the run"
