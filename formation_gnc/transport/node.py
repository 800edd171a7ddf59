"""What all nodes share: parameters from a schema, records on topics, the main loop."""

import sys
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from time import monotonic
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.task import Future
from rclpy.timer import Timer

try:
    from rclpy.experimental import EventsExecutor
except ImportError:  # missing in other builds of Jazzy; slower, same behaviour
    EventsExecutor = SingleThreadedExecutor

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.topics import QUEUE_DEPTH
from formation_gnc.parameters import OWN_OF_ROS, Leaf, dump, leaves, load, read_yaml
from formation_gnc.records import WARNINGS, Event
from formation_gnc.transport.conversion import codec, message_type
from formation_gnc.transport.process import stop_requested
from formation_gnc.transport.qos import LATEST, quality

Executor: Any = EventsExecutor

CHECK_PERIOD = 0.1
"""Wall time (s) after which a node notices at the latest that it has been asked to stop."""

FAREWELL = 0.5
"""Wall time (s) that a node waits at its end for its last messages to be acknowledged."""


class ConfiguredNode(Node):  # type: ignore[misc]
    """A node whose parameters come from a schema.

    `values` is the schema's instance. An override that the schema does not know or allow raises
    ConfigurationError, as does a later change of it, with the same words, through the parameter service.
    """

    def __init__(self, name: str, schema: type, namespace: str = "") -> None:
        """Declare the schema's parameters, with values from the command line and parameter files."""
        self._served_by: Any = None
        try:
            super().__init__(
                name,
                namespace=namespace,
                parameter_overrides=list(_from_command_line(sys.argv)),
                automatically_declare_parameters_from_overrides=True,
            )
        except ValueError as error:  # an empty list has no type for ROS
            raise ConfigurationError(f"a parameter is an empty list; leave it out ({error})") from None
        given = {
            parameter.name: parameter.value
            for parameter in self.get_parameters_by_prefix("").values()
            if not parameter.name.startswith(OWN_OF_ROS)
        }
        self.values: Any = load(schema, given)
        settled = dump(self.values)
        for leaf in leaves(schema, settled):
            value = settled[leaf.name]
            plain = list(value) if isinstance(value, tuple) else value
            if leaf.name in given:
                self.undeclare_parameter(leaf.name)
            self.declare_parameter(leaf.name, plain, _descriptor(leaf), ignore_override=True)

    def publisher_of(self, record: type, topic: str, depth: int = QUEUE_DEPTH) -> Callable[[Any], None]:
        """A function that publishes a record on a topic, of which `depth` messages are kept for late readers."""
        publisher = self.create_publisher(message_type(record), topic, quality(depth))
        encode: Callable[[Any], bytes] = codec(record).encode
        return lambda each: publisher.publish(encode(each))

    def subscribe(self, record: type, topic: str, callback: Callable[[bytes], object]) -> None:
        """Call back with the latest message of a record on a topic, as CDR bytes."""
        self.create_subscription(message_type(record), topic, callback, quality(LATEST), raw=True)

    def subscribe_decoded(self, record: type, topic: str, callback: Callable[[Any], object]) -> None:
        """As `subscribe`, with the record."""
        decode: Callable[[bytes], Any] = codec(record).decode
        self.subscribe(record, topic, lambda data: callback(decode(data)))

    def log_event(self, event: Event) -> None:
        """Log an event at the level of its kind; rclpy allows one level per line of code."""
        if event.kind in WARNINGS:
            self.get_logger().warning(str(event))
        else:
            self.get_logger().info(str(event))

    def create_wall_timer(self, period: float, callback: Callable[[], None]) -> Timer:
        """A timer on wall time, whatever `use_sim_time` says: simulated time stands still while a node waits."""
        return self.create_timer(period, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def spin(
        self, ended: Callable[[], bool] = stop_requested, period: Callable[[], float] = lambda: CHECK_PERIOD
    ) -> None:
        """Serve callbacks until `ended` says so, which is asked every `period` (s)."""
        if self._served_by is None:
            serve(self)
        while not ended():
            self._served_by.spin_until_future_complete(Future(), timeout_sec=period())

    def destroy_node(self) -> None:
        """Leave only when every reader has what was published."""
        deadline = monotonic() + FAREWELL
        for publisher in self.publishers:
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, deadline - monotonic())))
        if self._served_by is not None:
            self._served_by.remove_node(self)
        super().destroy_node()


def serve(*nodes: ConfiguredNode) -> None:
    """Let one executor serve nodes for all their life: a second one would lose what the first had noticed."""
    executor = Executor()
    for node in nodes:
        executor.add_node(node)
        node._served_by = executor


def _from_command_line(arguments: Sequence[str]) -> Iterator[Parameter]:
    """Parameters given with ``-p name:=value``.

    rclpy reads them too, but lets a parameter file's section for the node override them, whatever the order.
    """
    for flag, rule in pairwise(arguments):
        name, separator, value = rule.partition(":=")
        if flag in ("-p", "--param") and separator and ":" not in name:
            yield Parameter(name, value=read_yaml(value))


def _descriptor(leaf: Leaf) -> ParameterDescriptor:
    limits = leaf.limits
    unit = f" [{limits.unit}]" if limits.unit else ""
    return ParameterDescriptor(
        name=leaf.name,
        description=f"{limits.doc}{unit}",
        additional_constraints=limits.allowed(),
        read_only=not limits.in_flight,
        dynamic_typing=True,  # 5 is as good as 5.0; the schema checks the type
    )
