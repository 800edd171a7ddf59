"""The node of a flight module, whichever: its place in the graph is read from the graph table."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from math import inf
from threading import BoundedSemaphore
from time import monotonic, perf_counter, time_ns
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.service import Service

from formation_gnc.flight import topics
from formation_gnc.flight.backlog import STALLED, Backlog
from formation_gnc.flight.graph import ModuleInstance, Row, missing
from formation_gnc.flight.reception import Information, figures
from formation_gnc.parameters import dump
from formation_gnc.records import WARNINGS, EventKind, Timing
from formation_gnc.transport.bus import IntraProcessBus
from formation_gnc.transport.diagnostics import PERIOD, DiagnosticsPublisher
from formation_gnc.transport.node import CHECK_PERIOD, ConfiguredNode, rejected
from formation_gnc.types import NANOSECONDS

DESIGNS = 8
"""Requests to change parameters that may wait for their designs; more are rejected."""

ALONE = 1.0
"""Wall time (s) for which a dispensable input is awaited that no node is known to publish."""


class ModuleNode(ConfiguredNode):
    """Shell of a flight module of one deputy: messages to records, one call, records to messages.

    A change of parameters through the standard services is checked and designed in a thread of its own, so
    that no answer waits for it, and takes effect at the next tick; it is answered when that is settled, with
    the reason if it is rejected.

    A node that comes late, or has been busy, may find several ticks waiting; :class:`Backlog` decides where it resumes.
    """

    def __init__(self, row: Row, bus: IntraProcessBus | None = None) -> None:
        """Build the module from the node's parameters; the namespace is deputy1 unless it is remapped.

        row: of the graph table. bus: joins the modules of one process, of which each then has to `subscribe_inputs`
        once all are there.
        """
        super().__init__(row.name, row.parameters, namespace="deputy1")
        self._bus = bus or IntraProcessBus()
        self._instance = ModuleInstance(row, self.get_namespace().rpartition("/")[2], self.values)
        self._module = self._instance.module
        self._publish = {
            topic.of(self._instance.deputy): self._published(topic) for topic in self._instance.published()
        }
        self._publish_timing = self.publisher_of(Timing, topics.TIMING.of(self._instance.deputy))
        self._backlog = Backlog(self._instance, time_ns())
        self._catch_up_soon = self.create_wall_timer(STALLED / NANOSECONDS, self._catch_up)
        self._catch_up_soon.cancel()
        self._began = inf
        """Since when (s of a monotonic clock) a tick waits for what may have no publisher; infinite for none."""
        self.create_wall_timer(CHECK_PERIOD, self._forgo)
        if bus is None:
            self.subscribe_inputs()
        self._answered, self._warning = 0, ""
        self._diagnostics = DiagnosticsPublisher(self, self.full_name(f"/{self._instance.deputy}"))
        self.create_wall_timer(PERIOD, self._diagnose)
        self._designer = ThreadPoolExecutor(max_workers=1, thread_name_prefix="design")
        free = BoundedSemaphore(DESIGNS)
        for service in self.services:
            if service.srv_name.endswith(("/set_parameters", "/set_parameters_atomically")):
                _answer_from(self._designer, service, free)

    def _published(self, topic: topics.Topic) -> Callable[[Any], None]:
        name = topic.of(self._instance.deputy)
        publish, bus = self.publisher_of(topic.record, name), self._bus
        bus.advertise(name)

        def publish_on_both(record: Any) -> None:
            publish(record)
            bus.publish(name, record)

        return publish_on_both

    def subscribe_inputs(self) -> None:
        """Take the inputs: over the bus where a module of this process publishes them."""
        for topic, record in self._instance.inputs.items():
            if topic in self._bus:
                self._bus.subscribe(topic, partial(self._take, topic))
            else:
                self.subscribe(record, topic, partial(self._receive, topic))

    def _receive(self, topic: str, record: Any, about: Information) -> None:
        now, due = time_ns(), self._backlog.due
        if self._backlog.add(topic, record, about["source_timestamp"], now):
            self._take(topic, record)
        elif self._backlog.due is not None and self._backlog.due != due:
            self._catch_up_soon.timer_period_ns = self._backlog.due - now
            self._catch_up_soon.reset()

    def _catch_up(self) -> None:
        """Go on with what waits."""
        self._catch_up_soon.cancel()
        for topic, record in self._backlog.take():
            self._take(topic, record)

    def _take(self, topic: str, record: Any) -> None:
        """Answer the tick when the last input of its stamp is there."""
        synchronizer = self._instance.synchronizer
        inputs = synchronizer.take(topic, record)
        if inputs is None and topic == self._instance.needed[0] and not synchronizer.may_lag:
            self._began = monotonic()
        self._answer_all(inputs)

    def _forgo(self) -> None:
        """Go on without what nobody publishes, such as a mode where there is no supervisor.

        Who may lag gives up by itself, and is the first to answer a tick: whom it does not know of yet may still come.
        """
        synchronizer = self._instance.synchronizer
        if monotonic() - self._began < ALONE or synchronizer.unanswered is None:
            return
        self._began = inf
        silent = [topic for topic in self._instance.delayed if not self.identities_on(topic)]
        self._answer_all(synchronizer.forgo(silent) if silent else None)

    def _answer_all(self, inputs: Sequence[Any] | None) -> None:
        """Answer a tick, and those after it whose inputs were there before its own."""
        while inputs is not None:
            self._answer(inputs)
            inputs = self._instance.synchronizer.next()

    def _answer(self, inputs: Sequence[Any]) -> None:
        """Publish the answer to a tick; the outputs go first, others wait for them."""
        started = perf_counter()
        for name, output in self._instance.respond(inputs):
            self._publish[name](output)
        self._answered += 1
        spent = perf_counter() - started
        self._bus.deliver()
        name, spent_ns = self._instance.row.name, round(spent * NANOSECONDS)
        self._publish_timing(Timing(inputs[0].time, name, spent_ns, missing(inputs)))
        self._publish_events()

    def _publish_events(self) -> None:
        for event in self._instance.take_events():
            self.publish_event(event)
            if event.kind in WARNINGS:
                self._warning = str(event)
            if event.changes or event.kind == EventKind.REJECTED:
                self.show_parameters(dump(self._module.parameters))

    def _diagnose(self) -> None:
        """Publish whether the module answers, and its events since the last diagnostics."""
        level, message = DiagnosticStatus.OK, "answering"
        ignored = [each.topic for each in self.receptions if each.lock.ignored or each.misfits]
        if not self._answered:
            level, message = DiagnosticStatus.WARN, f"waiting for {' and '.join(self._instance.needed)}"
        elif self._module.waiting_for:
            level, message = DiagnosticStatus.WARN, f"waiting for {self._module.waiting_for}"
        elif self._warning:
            level, message = DiagnosticStatus.WARN, self._warning
        elif ignored:
            level, message = DiagnosticStatus.WARN, f"messages left out on {' and '.join(ignored)}"
        self._warning = ""
        values = {"tick": self._module.time // self._module.parameters.tick_ns, "answered": self._answered}
        values |= figures(self.receptions)
        self._diagnostics.publish(level, message, values, self._module.time, self._module.conditions())

    def simulated_time(self) -> int:
        """Stamp (ns) of the module's latest tick."""
        return self._module.time

    def warn(self, subject: str, detail: str) -> None:
        """Publish an event of this node that somebody should look at, and give it in the diagnostics."""
        super().warn(subject, detail)
        self._warning = f"{subject}: {detail}"

    def stage_parameters(self, changes: Mapping[str, Any]) -> tuple[Any, Callable[[], None]]:
        """Design for a change; it takes effect at the next tick."""
        staged = self._module.stage(changes)
        return staged.parameters, lambda: self._module.commit(staged)

    def destroy_node(self) -> None:
        """Let no design outlive the node."""
        self._designer.shutdown(wait=False, cancel_futures=True)
        super().destroy_node()


def _answer_from(pool: ThreadPoolExecutor, service: Service, free: BoundedSemaphore) -> None:
    """Let a thread of `pool` work out a service's responses and send each when it is there; reject those too many."""
    handle, send = service.callback, service.send_response

    def answer(request: Any, response: Any) -> Any:
        if not free.acquire(blocking=False):
            return rejected(request, response, f"{DESIGNS} changes wait for their designs already; try again later")
        designed = pool.submit(handle, request, response)
        designed.add_done_callback(lambda _: free.release())
        return designed

    def send_when_done(answer: Any, header: Any) -> None:
        if isinstance(answer, Future):
            answer.add_done_callback(lambda done: send(done.result(), header))
        else:
            send(answer, header)

    service.callback, service.send_response = answer, send_when_done
