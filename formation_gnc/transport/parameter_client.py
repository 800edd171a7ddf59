"""Sets parameters of a running node through the standard services."""

import difflib
from collections.abc import Mapping
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.task import Future

from formation_gnc.errors import ConfigurationError
from formation_gnc.transport.parameter_reader import ParameterReader

DISCOVERY = 10.0
"""Wall time (s) that a node has to be discovered, and to answer."""


def set_parameters(name: str, values: Mapping[str, Any], domain: int | None = None) -> None:
    """Set parameters of a node, all or none.

    Args:
        name: full name of the node.
        values: by parameter; a whole number is a double where the parameter is one.
        domain: of ROS; None for that of the environment.

    Raises:
        ConfigurationError: no such node, a value of another type, or the node rejects the change.
    """
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    node = rclpy.create_node("set", context=context, start_parameter_services=False)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def wait(answer: Future) -> Any:
        executor.spin_until_future_complete(answer, timeout_sec=DISCOVERY)
        if not answer.done():
            raise ConfigurationError(f"node {name}: does not answer within {DISCOVERY:g} s")
        return answer.result()

    try:
        client = AsyncParameterClient(node, name)
        if not client.wait_for_services(timeout_sec=DISCOVERY):
            raise ConfigurationError(f"node {name}: not in this ROS domain; {_hint(node, name)}")
        types = wait(client.get_parameter_types(list(values))).types
        parameters = [
            _parameter(each, Parameter.Type(kind), values[each]) for each, kind in zip(values, types, strict=False)
        ]
        if len(parameters) < len(values):  # ROS leaves the types out when one name is unknown
            parameters = [Parameter(each, value=value) for each, value in values.items()]
        result = wait(client.set_parameters_atomically(parameters)).result
        if not result.successful:
            raise ConfigurationError(f"node {name}: {result.reason}")
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


def _parameter(name: str, value: Any, kind: Parameter.Type) -> Parameter:
    if kind == Parameter.Type.NOT_SET:
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
    known = sorted(ParameterReader(node).nodes())
    near = difflib.get_close_matches(name, known, n=1)
    if near:
        return f"did you mean {near[0]}?"
    return f"it has {', '.join(known)}" if known else "it has no node with parameters; set ROS_DOMAIN_ID to the run's"
