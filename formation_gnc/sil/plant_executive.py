"""Runs the plant on the node graph: start, deadlines, pace, a recorder that lags, reports, the end."""

from collections.abc import Iterator, Sequence
from typing import Any, Protocol

from formation_gnc.errors import RecorderLostError
from formation_gnc.flight import topics
from formation_gnc.flight.barrier import Decision
from formation_gnc.flight.graph import COMMAND, GRAPH, RECORDER, commanding
from formation_gnc.flight.sources import is_shared, names_of, shared
from formation_gnc.plant.parameters import PlantParameters
from formation_gnc.records import Thrust
from formation_gnc.sil.report import Report
from formation_gnc.sil.simulation import Simulation, Sink
from formation_gnc.types import NANOSECONDS

CHECK_PERIOD = 0.05
"""Wall time (s) between checks of deadlines, of the recorder and of who is there."""

REPORT_PERIOD = 0.5
"""Wall time (s) between reports."""

CONTRADICTIONS = 3
"""Contradicting answers of a deputy that show two commanders; one that is started again may contradict itself once."""

NAMED = 3
"""Topics without a publisher that are named."""

COMPANY = 60.0
"""Wall time (s) for which modules are awaited without which there would be commands too, such as the supervisor."""

LINGERING = 30.0
"""Wall time (s) after which DDS has forgotten a node that was killed: two of one name for longer are two."""


STALLED = 30.0
"""Wall time (s) without progress of the recorder, while the run waits for it, that is warned of."""


class Surroundings(Protocol):
    """The graph as the executive sees it, and its outputs."""

    def has_recorder(self) -> bool:
        """Whether a recorder reports progress."""

    def recorder_listens(self) -> bool:
        """Whether a recorder has subscribed to every topic of the run, and knows all parameters."""

    def publishers_of(self, topic: str) -> list[str]:
        """Full names of the nodes that publish a topic, once for each publisher, this one's included."""

    def publish(self, topic: str, record: Any) -> None:
        """Publish a record."""

    def log(self, text: str) -> None:
        """Log a line."""

    def report(self, report: Report) -> None:
        """Publish where the run is."""


class PlantExecutive:
    """Starts a run when everybody is there, and takes it to its end.

    The run starts when every deputy's modules are there, and the recorder if it is to be waited for; from then
    on the tick barrier decides. Times `now` are seconds of a monotonic wall clock.
    """

    def __init__(self, parameters: PlantParameters, surroundings: Surroundings) -> None:
        """Build the plant; raises ConfigurationError for what cannot be flown."""
        self._parameters, self._around = parameters, surroundings
        self.simulation = Simulation(parameters, parameters.deadline)
        self._publish: Sink = surroundings.publish
        self._began = self._reported = 0.0
        self._said = ""
        deputies = parameters.deputies
        self._own = (topics.CLOCK.name, topics.TRUTH.name, *map(topics.MEASUREMENT.of, deputies))
        self._answers = [topic.of(deputy) for deputy in deputies for row in GRAPH for topic in row.gives]
        self._commands = {COMMAND.of(deputy): deputy for deputy in deputies}
        self._troubles: dict[str, None] = {}
        self._recorder_is_missed = False
        self._recorded_at = 0.0
        """Wall time (s) of the recorder's arrival or latest progress."""
        self._stall = ""
        """What was said of a recorder that makes no progress."""
        self._shared_since: dict[str, float] = {}
        self._needed = frozenset(row.answer.of(deputy) for deputy in deputies for row in commanding())
        """Answers without which there is no command."""
        self._alone_since = 0.0
        """Since when all of these have a publisher, s."""

    @property
    def finished(self) -> bool:
        """Whether all ticks are flown."""
        return self.simulation.plant.finished

    def check(self, now: float) -> bool:
        """Do what no message triggers; called every `period`. Returns whether all ticks are flown.

        Raises:
            RecorderLostError: the recorder is gone, and the run is to end then.
        """
        barrier = self.simulation.barrier
        if not self.simulation.has_begun:
            self._begin_if_all_are_there(now)
        elif not self.finished:
            self._look_for_recorder(now)
            barrier.check(now)
            self._say_what_is_awaited(barrier.decide(now), now)
            self.advance_if_ready(now)
            if now - self._reported > REPORT_PERIOD and not self.finished:
                self._note_troubles(now)
                self._report("flying", now)
        return self.finished

    def answer(self, deputy: str, thrust: Thrust, now: float) -> bool:
        """Take a thrust command; returns whether it counts."""
        counts = self.simulation.answer(deputy, thrust)
        if counts:
            self.advance_if_ready(now)
        return counts

    def recorded(self, stamp: int, now: float) -> None:
        """Take the recorder's word that it has everything up to a stamp (ns)."""
        if stamp != self.simulation.barrier.recorded:
            self._recorded_at = now
            if self._stall:
                del self._troubles[self._stall]
                self._stall = ""
                self._warn_of_recorder(f"{RECORDER} records again")
        self.simulation.barrier.recorded = stamp
        if self.simulation.has_begun:
            self.advance_if_ready(now)

    def advance_if_ready(self, now: float) -> None:
        """Fly the tick if the barrier lets it end."""
        if self.finished:
            return
        decision = self.simulation.advance_if_ready(now, self._publish, self._absent)
        if decision.advance and self.finished:
            self._report("finished", now)

    def period(self, now: float) -> float:
        """Wall time (s) until the next check."""
        pause = self.simulation.barrier.decide(now).pause if self.simulation.has_begun else 0.0
        return min(CHECK_PERIOD, pause) if pause > 0.0 else CHECK_PERIOD

    def recorder_is_done(self, now: float) -> bool:
        """Whether the recorder, if there is one, has everything to the end."""
        barrier = self.simulation.barrier
        barrier.has_recorder = self._around.has_recorder()
        if barrier.recorder_is_done(self.simulation.plant.time):
            return True
        self._look_for_stall(now)
        return False

    def _look_for_recorder(self, now: float) -> None:
        """Go on, or end, as soon as a recorder has died; raises RecorderLostError to end."""
        barrier = self.simulation.barrier
        had, barrier.has_recorder = barrier.has_recorder, self._around.has_recorder()
        if barrier.has_recorder and not had:
            self._recorded_at = now
        if barrier.has_recorder and self._recorder_is_missed:
            self._recorder_is_missed = False
            self._warn_of_recorder("recorded again")
        elif had and not barrier.has_recorder:
            self._recorder_is_missed, barrier.recorded = True, None
            ends = self._parameters.on_recorder_loss == "end"
            text = f"the recorder is gone: the run {'ends' if ends else 'goes on unrecorded'} (on_recorder_loss)"
            self._troubles[text] = None
            self._warn_of_recorder(text)
            if ends:
                self._report("ended", self._reported)
                raise RecorderLostError(f"{text}; {self.simulation.plant.tick} ticks flown")

    def _look_for_stall(self, now: float) -> None:
        """Warn of a recorder that is waited for and makes no progress."""
        if now - self._recorded_at > STALLED and not self._stall:
            recorded = (self.simulation.barrier.recorded or 0) / NANOSECONDS
            self._stall = f"{RECORDER} records nothing after {recorded:g} s, and the run waits for it"
            self._troubles[self._stall] = None
            self._warn_of_recorder(self._stall)

    def _warn_of_recorder(self, text: str) -> None:
        self._publish(topics.EVENTS.name, self.simulation.warning(text, topics.PROGRESS.name))

    def _begin_if_all_are_there(self, now: float) -> None:
        missing = ", ".join(self._missing(now))
        self._say(f"waiting for {missing}" if missing else "flying")
        if missing:
            self._report(self._said, now)
        else:
            self._began = now
            self.simulation.open_tick(now, self._publish)

    def _rivals(self, topics_of_one: Sequence[str]) -> Iterator[str]:
        """Topics that must have one publisher and have several, in words."""
        for topic, names in shared(topics_of_one, self._around.publishers_of):
            yield f"only one publisher of {topic}: {names} are in this ROS domain"

    def _note_troubles(self, now: float) -> None:
        """Publish, once each, that more than one node does what one has to."""
        found = [f"needs {rivals}" for rivals in self._rivals(self._own)]
        for topic in (topics.PROGRESS.name, *self._answers):
            publishers = self._around.publishers_of(topic)
            contradicts = self.simulation.barrier.contradictions[self._commands.get(topic, "")] >= CONTRADICTIONS
            since = self._shared_since.setdefault(topic, now) if len(publishers) > 1 else now
            if len(publishers) < 2:
                self._shared_since.pop(topic, None)
            if is_shared(publishers) or contradicts or now - since > LINGERING:
                found.append(f"{topic} has several publishers: {names_of(publishers)}")
        for trouble in found:
            if trouble not in self._troubles:
                self._troubles[trouble] = None
                self._publish(topics.EVENTS.name, self.simulation.warning(trouble))

    def _absent(self) -> list[str]:
        return [topic for topic, _ in self.simulation.answers() if not self._around.publishers_of(topic)]

    def _missing(self, now: float) -> Iterator[str]:
        absent = self._absent()
        if not absent or self._needed.intersection(absent):
            self._alone_since = now
        if absent and now - self._alone_since < COMPANY:
            modules = dict(self.simulation.answers())
            named = ", ".join(f"{topic} ({modules[topic]})" for topic in absent[:NAMED])
            yield f"a publisher of {named}" + (f" and {len(absent) - NAMED} more" if len(absent) > NAMED else "")
        yield from self._rivals((*self._own, *self._answers))
        if self._parameters.wait_for_recorder and not (
            self.simulation.barrier.recorded is not None and self._around.recorder_listens()
        ):
            yield RECORDER

    def _say_what_is_awaited(self, decision: Decision, now: float) -> None:
        if not decision.overdue:
            return
        if RECORDER in decision.waiting_for:
            self._say(f"waiting for {RECORDER}, which lags behind")
            self._look_for_stall(now)
        elif decision.waiting_for:
            self._say(f"waiting for the first answer of {', '.join(decision.waiting_for)}")

    def _say(self, text: str) -> None:
        if text != self._said:
            self._around.log(text)
            self._said = text

    def _report(self, message: str, now: float) -> None:
        self._reported = now
        elapsed = now - self._began if self.simulation.has_begun else 0.0
        self._around.report(Report(message, self.simulation.figures(elapsed), tuple(self._troubles)))
