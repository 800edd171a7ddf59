"""What all nodes share: parameters from a schema, the main loop, and the shell of a part."""

import gc
import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import pairwise
from pathlib import Path
from time import monotonic, perf_counter
from types import MappingProxyType
from typing import Any

import rclpy
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy._rclpy_pybind11 import RCLError, RCLInvalidROSArgsError, RMWError, UnknownROSArgsError
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.service import Service
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.timer import Timer

try:
    from rclpy.experimental import EventsExecutor
except ImportError:  # other builds of Jazzy do not have it; theirs is slower and does the same
    EventsExecutor = SingleThreadedExecutor

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.module import FlightModule
from formation_gnc.flight.synchronizer import StampSynchronizer
from formation_gnc.orbit.propagation import ImpactError
from formation_gnc.parameters import OWN_OF_ROS, Leaf, dump, leaves, load, read_yaml
from formation_gnc.records import Event, Record, Timing
from formation_gnc.transport import topics
from formation_gnc.transport.bus import IntraProcessBus
from formation_gnc.transport.conversion import codec, message_type
from formation_gnc.types import NANOSECONDS

Executor: Any = EventsExecutor

REJECTED_BY_ROS = (RCLInvalidROSArgsError, UnknownROSArgsError, RCLError, RMWError)
"""What rclpy raises for arguments, parameter files and middleware it cannot use."""

CHECK_PERIOD = 0.1
"""Wall time (s) after which a node notices at the latest that it has been asked to stop."""

FAREWELL = 0.5
"""Wall time (s) that a node waits at its end for its last messages to arrive."""

SETTLING = 0.1
"""Wall time (s) that a node which has just started listens, from the first message on, before it answers."""

_stop_signals: list[int] = []
"""Signals that have asked the process to stop. A bare list, since a handler that takes a lock, such as a
future's, waits for ever when it interrupts the one who holds it."""


def asked_to_stop() -> bool:
    """Whether SIGINT or SIGTERM has come."""
    return bool(_stop_signals)


class ConfiguredNode(Node):  # type: ignore[misc]
    """A node whose parameters come from a schema.

    `values` is the schema's instance. An override that the schema does not know or allow raises
    ConfigurationError, as does a later change of it, with the same words, through the parameter service.
    """

    def __init__(self, name: str, schema: type, namespace: str = "") -> None:
        """Declare the schema's parameters, with values from the command line and parameter files."""
        self._executor: Any = None
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

    def speak[T: Record](self, record: type[T], topic: str) -> Callable[[T], None]:
        """A function that publishes a record on a topic."""
        publisher = self.create_publisher(message_type(record), topic, topics.quality())
        encode = codec(record).encode
        return lambda each: publisher.publish(encode(each))

    def listen(self, record: type[Record], topic: str, hear: Callable[[bytes], object]) -> None:
        """Let `hear` have the latest message of a record on a topic, as it came."""
        quality = topics.quality(topics.LATEST)
        self.create_subscription(message_type(record), topic, hear, quality, raw=True)

    def spin(
        self,
        ended: Callable[[], bool] = asked_to_stop,
        period: Callable[[], float] = lambda: CHECK_PERIOD,
    ) -> None:
        """Work until `ended` says so, which is asked every `period` (s)."""
        if self._executor is None:
            serve(self)
        while not ended():
            self._executor.spin_until_future_complete(Future(), timeout_sec=period())

    def destroy_node(self) -> None:
        """Leave only when everybody has what was published."""
        deadline = monotonic() + FAREWELL
        for publisher in self.publishers:
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, deadline - monotonic())))
        if self._executor is not None:
            self._executor.remove_node(self)
        super().destroy_node()


def serve(*nodes: ConfiguredNode) -> None:
    """Let one executor serve nodes for all their life: a message that one has noticed but not handled is
    lost to the next."""
    executor = Executor()
    for node in nodes:
        executor.add_node(node)
        node._executor = executor


def _from_command_line(arguments: Sequence[str]) -> Iterator[Parameter]:
    """Parameters given with ``-p name:=value``.

    rclpy knows them too, but there a parameter file's section for the node goes before them, whatever the
    order: who types one means it.
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
        dynamic_typing=True,  # so that 5 is as good as 5.0; the schema checks the type
    )


class ModuleNode[P: FlightModule[Any, Any]](ConfiguredNode):
    """Shell of a part of one deputy: messages to records, one call, records to messages.

    A change of parameters through the standard services is checked and designed in a thread of its own, so
    that no answer waits for it, and takes over at the next tick; it is answered when that is settled, with
    the reason if it is rejected.
    """

    def __init__(
        self, name: str, schema: type, part: Callable[[str, Any], P], bus: IntraProcessBus | None = None
    ) -> None:
        """Build the part from the node's parameters; the namespace is deputy1 unless it is remapped.

        `bus` join it to the parts in the same process.
        """
        super().__init__(name, schema, namespace="deputy1")
        self._bus = bus or IntraProcessBus()
        self.part = part(self.get_fully_qualified_name(), self.values)
        self._kind = self.get_name()
        self._tell_event = self.speak(Event, topics.EVENTS)
        self._tell_timing = self.speak(Timing, topics.TIMING)
        self._designer = ThreadPoolExecutor(max_workers=1, thread_name_prefix="design")
        self.add_on_set_parameters_callback(self._on_set_parameters)
        for service in self.services:
            if service.srv_name.endswith(("/set_parameters", "/set_parameters_atomically")):
                _answer_from(self._designer, service)

    def say[T: Record](self, record: type[T], topic: str) -> Callable[[T], None]:
        """A function that publishes a record on a topic that parts in the same process may answer."""
        publish, hand_on = self.speak(record, topic), self._bus.speak(topic)

        def say(each: T) -> None:
            publish(each)
            hand_on(each)

        return say

    def answer(
        self,
        respond: Callable[..., None],
        inputs: Mapping[str, type[Record]],
        others: Mapping[str, type[Record]] = MappingProxyType({}),
    ) -> None:
        """Call `respond` once per stamp, when one record of it is there from every input topic.

        One of every topic of `others` comes after the inputs. These are not indispensable, and None when they
        are lost, as :class:`StampSynchronizer` says.

        A node that comes late is told much of what was said before it came, and goes by the last of it: an
        answer to more would look like a new run to those who have gone on.
        """
        meeting = StampSynchronizer((*inputs, *others), len(inputs))
        settled = next(iter(inputs)) in self._bus
        latest: dict[str, Callable[[], None]] = {}

        def take(topic: str, record: Any) -> None:
            started = perf_counter()
            records = meeting.take(topic, record)
            if records is None:
                return
            respond(*records)
            spent = perf_counter() - started
            self._bus.deliver()
            self._finish_tick(records[0].time, spent)

        def arrive(topic: str, read: Callable[[bytes], Any], data: bytes) -> None:
            if settled:
                take(topic, read(data))
                return
            if not latest:
                timer: Timer = self.create_timer(SETTLING, lambda: settle(timer))
            latest[topic] = partial(take, topic, read(data))

        def settle(timer: Timer) -> None:
            nonlocal settled
            timer.cancel()
            settled = True
            for each in latest.values():
                each()

        for topic, record in {**inputs, **others}.items():
            if topic in self._bus:
                self._bus.hear(topic, partial(take, topic))
            else:
                self.listen(record, topic, partial(arrive, topic, codec(record).decode))

    def _finish_tick(self, time: int, spent: float) -> None:
        """Publish what nobody waits for: the events, and the wall time (s) that the answer took."""
        self._tell_timing(Timing(time, self._kind, round(spent * NANOSECONDS)))
        for event in self.part.take_events():
            self.get_logger().info(str(event))
            self._tell_event(event)

    def _on_set_parameters(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        changes = {each.name: each.value for each in parameters if not each.name.startswith(OWN_OF_ROS)}
        if changes:
            try:
                self.part.commit(self.part.stage(changes))
            except ConfigurationError as rejection:
                return SetParametersResult(successful=False, reason=str(rejection))
        return SetParametersResult(successful=True)

    def destroy_node(self) -> None:
        """Let no design outlive the node."""
        self._designer.shutdown(wait=False, cancel_futures=True)
        super().destroy_node()


def _answer_from(pool: ThreadPoolExecutor, service: Service) -> None:
    """Let a thread of `pool` work out a service's answers and send each when it is there."""
    handle, send = service.callback, service.send_response
    service.callback = lambda request, response: pool.submit(handle, request, response)
    service.send_response = lambda answer, header: answer.add_done_callback(lambda done: send(done.result(), header))


def run(make_node: Callable[[], Any], fly: Callable[[Any], None] = ConfiguredNode.spin) -> int:
    """Body of every executable: make the node, let it fly, and end with the exit status.

    A signal is only noted, since a node that has been asked to stop still has to hand over what it published
    or recorded.

    Returns:
        0 after an ordinary end or an interruption, 1 when a satellite came down or a disk took no more, 2
        when something given to the node is not allowed.
    """
    node = None
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: _stop_signals.append(number))
    try:
        rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
        node = make_node()
        gc.freeze()  # what was built to fly lives to the end: no use looking through it again and again
        fly(node)
    except (ConfigurationError, *REJECTED_BY_ROS) as rejection:
        print(f"{Path(sys.argv[0]).name}: {' '.join(str(rejection).split())}", file=sys.stderr)
        return 2
    except (ImpactError, OSError) as end:
        print(f"{Path(sys.argv[0]).name}: {end}", file=sys.stderr)
        return 1
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0
