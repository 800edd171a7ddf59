"""What all nodes share: parameters from a schema, records on topics, the main loop."""

import sys
from collections.abc import Callable, Mapping
from functools import cached_property, partial
from time import monotonic
from typing import Any

import yaml
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rcl_interfaces.srv import SetParameters
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.timer import Timer

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight import topics
from formation_gnc.flight.graph import PLANT
from formation_gnc.flight.reception import Information, Reception
from formation_gnc.flight.topics import QUEUE_DEPTH
from formation_gnc.messages.conversion import codec, received
from formation_gnc.parameters import OWN_OF_ROS, Leaf, change, dump, leaves, load, read_yaml
from formation_gnc.records import WARNINGS, Event, EventKind
from formation_gnc.sil.following import departures, values_of_plant, with_followed
from formation_gnc.transport.identified import identities, inbox_of
from formation_gnc.transport.loop import Loop
from formation_gnc.transport.message_types import message_type
from formation_gnc.transport.parameter_arguments import given_parameters, without_parameters
from formation_gnc.transport.process import stop_requested
from formation_gnc.transport.qos import quality
from formation_gnc.transport.subscriptions import subscribe_to_all
from formation_gnc.types import NANOSECONDS

CHECK_PERIOD = 0.1
"""Wall time (s) after which a node notices at the latest that it has been asked to stop."""

FAREWELL = 0.5
"""Wall time (s) that a node waits at its end for its last messages to be acknowledged."""


class ConfiguredNode(Node):  # type: ignore[misc]
    """A node whose parameters come from a schema.

    `values` is the schema's instance. A parameter that the schema does not know or allow raises
    ConfigurationError, as does a later change of it, with the same words, through the parameter service. One that
    is given to all nodes and belongs to another is left out, with a warning. One that is not given, and follows the
    plant's, has the value that the same files give the plant; one that differs from it is warned of.

    Names of topics are those within the formation, whatever namespace it is in (:meth:`full_name`).
    """

    def __init__(self, name: str, schema: type, namespace: str = "") -> None:
        """Declare the schema's parameters, with values from the command line and parameter files.

        namespace: of the node within its formation, unless it is remapped; empty or one token.
        """
        self._loop: Loop | None = None
        self.receptions: list[Reception[Any]] = []
        super().__init__(name, namespace=namespace, cli_args=without_parameters(sys.argv), use_global_arguments=False)
        full_name, depth = self.get_fully_qualified_name(), 2 if namespace else 1
        self._formation = full_name.rsplit("/", depth)[0]
        given = given_parameters(sys.argv, (full_name, full_name.removeprefix(self._formation)))
        self._set_those_of_ros(given.take(OWN_OF_ROS))
        for foreign, source in given.drop_foreign(schema).items():
            self.get_logger().warning(f"parameter {foreign}, given to all nodes by {source}: none of mine, ignored")
        plant = values_of_plant(given_parameters(sys.argv, (self.full_name(PLANT), PLANT)).values)
        deputy = full_name.split("/")[-2] if namespace else ""
        self.values: Any = load(schema, with_followed(schema, given.values, plant, deputy))
        for difference in departures(self.values, plant, deputy):
            self.get_logger().warning(difference)
        settled = dump(self.values)
        self._leaves = {leaf.name: leaf for leaf in leaves(schema, settled)}
        for leaf in self._leaves.values():
            self._declare(leaf, settled[leaf.name])
        self.create_wall_timer(CHECK_PERIOD, self._look_at_receptions)
        for service in self.services:
            if service.srv_name.endswith(("/set_parameters", "/set_parameters_atomically")):
                service.callback = _rejecting_malformed(service.callback)

    def full_name(self, topic: str) -> str:
        """Full name of a topic, in the namespace of this formation."""
        return f"{self._formation}{topic}"

    def stage_parameters(self, changes: Mapping[str, Any]) -> tuple[Any, Callable[[], None]]:
        """Validate a change in flight; returns the parameters with it, and what makes it.

        Raises:
            ConfigurationError: the change is not allowed; nothing has changed.
        """
        return change(self.values, changes), lambda: None

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Answer the parameter services; a parameter that is set to its value is left alone, even a read-only one."""
        of_ros = [each for each in parameter_list if each.name.startswith(OWN_OF_ROS)]
        values = {each.name: each.value for each in parameter_list if each not in of_ros}
        commit: Callable[[], None] | None = None
        try:
            if values:
                changes = {name: self._from_ros(name, value) for name, value in values.items()}
                parameters, commit = self.stage_parameters(changes)
        except ConfigurationError as rejection:
            return SetParametersResult(successful=False, reason=str(rejection))
        of_ros = [each for each in of_ros if not self._has(each.name, each.value)]
        if of_ros:
            result = super().set_parameters_atomically(of_ros)
            if not result.successful:
                return result
        if commit is not None:
            self.show_parameters(dump(parameters))
            commit()
        return SetParametersResult(successful=True)

    def show_parameters(self, values: Mapping[str, Any]) -> None:
        """Let the parameter services give these values."""
        shown = (_parameter(self._leaves[name], value) for name, value in values.items())
        changed = [each for each in shown if each.value != self.get_parameter(each.name).value]
        if changed:
            super().set_parameters_atomically(changed)

    def _declare(self, leaf: Leaf, value: Any) -> None:
        """Declare a parameter with its value; an empty list has no type of its own."""
        descriptor = _descriptor(leaf)
        if value != ():
            self.declare_parameter(leaf.name, _parameter(leaf, value).value, descriptor, ignore_override=True)
            return
        self.declare_parameter(leaf.name, [], ParameterDescriptor(dynamic_typing=True), ignore_override=True)
        super().set_parameters_atomically([_parameter(leaf, value)])
        self.set_descriptor(leaf.name, descriptor)

    def _from_ros(self, name: str, value: Any) -> Any:
        """A value as `ros2 param` sends it: what YAML 1.1 takes for text, such as 1e-06, may be meant as a number."""
        leaf = self._leaves.get(name)
        if leaf is None or leaf.type is str:
            return value
        if isinstance(value, str):
            return _read(value)
        if isinstance(value, list) and leaf.type != tuple[str, ...]:
            return [_read(each) if isinstance(each, str) else each for each in value]
        return value

    def _has(self, name: str, value: Any) -> bool:
        return bool(self.has_parameter(name) and self.get_parameter(name).value == value)

    def _set_those_of_ros(self, values: Mapping[str, Any]) -> None:
        """Set parameters that rclpy declares by itself."""
        for name, value in values.items():
            if not self.has_parameter(name) or self._has(name, value):
                continue
            result = super().set_parameters_atomically([Parameter(name, value=value)])
            if not result.successful:
                raise ConfigurationError(f"parameter {name}: {value!r} is not allowed; {result.reason}")

    def publisher_of(self, record: type, topic: str, depth: int = QUEUE_DEPTH) -> Callable[[Any], None]:
        """A function that publishes a record on a topic, of which `depth` messages are kept for late readers."""
        publisher = self.create_publisher(message_type(record), self.full_name(topic), quality(depth))
        encode: Callable[[Any], bytes] = codec(record).encode
        return lambda each: publisher.publish(encode(each))

    def subscribe(
        self,
        record: type,
        topic: str,
        take: Callable[[Any, Information], object],
        depth: int = QUEUE_DEPTH,
        decode: Callable[[bytes], Any] | None = None,
    ) -> Reception[Any]:
        """Call `take` with a topic's records that count, and with what is known of each (:class:`Reception`).

        depth: messages kept between two callbacks, of all publishers: a burst of a stranger's must not push out the one
        that is awaited. decode: what to make of a message; its record by default.
        """
        reception = Reception(topic, decode or received(record), take, partial(self.identities_on, topic))
        self.receptions.append(reception)
        subscribe_to_all(self, message_type(record), self.full_name(topic), reception.receive, depth)
        return reception

    def identities_on(self, topic: str) -> dict[bytes, str]:
        """Full names of the nodes that publish a topic, by the identities of their publishers."""
        return identities(self, self.full_name(topic))

    def publishers_of(self, topic: str) -> list[str]:
        """Full names of the nodes that publish a topic, once for each publisher."""
        return list(self.identities_on(topic).values())

    def simulated_time(self) -> int:
        """Stamp (ns) at which this node is."""
        return 0

    @cached_property
    def publish_event(self) -> Callable[[Event], None]:
        """Publishes and logs an event."""
        publish = self.publisher_of(Event, topics.EVENTS.name)

        def publish_and_log(event: Event) -> None:
            publish(event)
            self.log_event(event)

        return publish_and_log

    def warn(self, subject: str, detail: str) -> None:
        """Publish an event of this node that somebody should look at; `subject` is a topic's name."""
        time, node = self.simulated_time(), self.get_fully_qualified_name().removeprefix(self._formation)
        tick = time // round(self.values.tick * NANOSECONDS)
        self.publish_event(Event(time, tick, node, EventKind.WARNING, subject, [], detail))

    def _look_at_receptions(self) -> None:
        for reception in self.receptions:
            for text in reception.look():
                self.warn(reception.topic, text)

    def log_event(self, event: Event) -> None:
        """Log an event at the level of its kind; rclpy allows one level per line of code."""
        if event.kind == EventKind.LOST:
            self.get_logger().error(str(event))
        elif event.kind in WARNINGS:
            self.get_logger().warning(str(event))
        else:
            self.get_logger().info(str(event))

    def create_wall_timer(self, period: float, callback: Callable[[], None]) -> Timer:
        """A timer on wall time, whatever `use_sim_time` is: simulated time stands still while a node waits."""
        return self.create_timer(period, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def spin(
        self, ended: Callable[[], bool] = stop_requested, period: Callable[[], float] = lambda: CHECK_PERIOD
    ) -> None:
        """Serve callbacks until `ended`, checked every `period` (s), returns true."""
        loop = self._loop or serve(self)
        while not ended():
            loop.spin(period())

    def destroy_node(self) -> None:
        """Leave only when every reader has what was published."""
        deadline = monotonic() + FAREWELL
        for publisher in self.publishers:
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, deadline - monotonic())))
        if self._loop is not None:
            self._loop.remove(self)
        inbox_of(self).clear()
        super().destroy_node()


def _parameter(leaf: Leaf, value: Any) -> Parameter:
    kind = Parameter.Type[leaf.type_name.replace(" ", "_").upper()]
    return Parameter(leaf.name, kind, list(value) if isinstance(value, tuple) else value)


def _read(text: str) -> Any:
    """What a text is in YAML; the text itself where it is none."""
    try:
        return read_yaml(text)
    except yaml.YAMLError:
        return text


def _rejecting_malformed[S](handle: Callable[[Any, S], S]) -> Callable[[Any, S], S]:
    """A handler of requests to set parameters that rejects one with a value of no type that ROS has."""

    def answer(request: Any, response: Any) -> Any:
        try:
            for each in request.parameters:
                Parameter.from_parameter_msg(each)
        except ValueError as error:
            return rejected(request, response, f"malformed request: {error}")
        return handle(request, response)

    return answer


def rejected(request: Any, response: Any, reason: str) -> Any:
    """Response to a request to set parameters that rejects all of it."""
    rejection = SetParametersResult(successful=False, reason=reason)
    if isinstance(request, SetParameters.Request):
        response.results = [rejection] * len(request.parameters)
    else:
        response.result = rejection
    return response


def serve(*nodes: ConfiguredNode) -> Loop:
    """Let one loop serve nodes for all their life."""
    loop = Loop(*nodes)
    for node in nodes:
        node._loop = loop
    return loop


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
