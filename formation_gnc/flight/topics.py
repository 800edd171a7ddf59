"""Topics of a run: names, records and contents, once.

Names without a leading slash are in a deputy's namespace: `estimate` of `deputy1` is `/deputy1/estimate`.
"""

from dataclasses import dataclass
from typing import Any

from formation_gnc import mode_records, records

QUEUE_DEPTH = 500
"""Messages that a writer keeps for who is late or slow, and that the recorder may lag behind.

DDS repairs losses 256 messages at a time: many times more, from all writers at once to a recorder that joins on
a busy machine, have held a flight up for most of a minute.
"""


@dataclass(frozen=True)
class Topic:
    """One topic.

    record: what it carries; None for a message of another package that no module reads.
    message: its type, `package/Type`; of the record where there is one.
    every_tick: whether a node that publishes it does so at every tick it answers.
    fleet_only: whether it exists in a fleet only.
    """

    name: str
    record: Any
    when: str
    contents: str
    message: str = ""
    every_tick: bool = True
    fleet_only: bool = False

    def of(self, deputy: str) -> str:
        """Full name in a deputy's namespace."""
        return f"/{deputy}/{self.name}"


CLOCK = Topic("/clock", None, "every tick", "simulated time of the tick", "rosgraph_msgs/Clock")
TRUTH = Topic("/truth", records.Truth, "every tick", "true states, masses, forces of the tick before, eclipse flags")
EVENTS = Topic(
    "/events",
    records.Event,
    "when something happens",
    "changes of parameters and mode, hand-overs, fallbacks, rejections, misses, faults injected, detected and "
    "answered, the end of the run, each with its tick",
    every_tick=False,
)
DIAGNOSTICS = Topic(
    "/diagnostics",
    None,
    "twice a second of wall time",
    "state of the run from the plant: what it waits for, tick, misses, speed; state of every node",
    "diagnostic_msgs/DiagnosticArray",
    every_tick=False,
)
PROGRESS = Topic(
    "/recorder/progress",
    None,
    "ten times a second of wall time, or every 64 ticks",
    "stamp up to which everything is recorded; the plant stays within the queues' depth of it",
    "rosgraph_msgs/Clock",
    every_tick=False,
)
MARKERS = Topic(
    "/markers",
    None,
    "`rate` times a second of wall time",
    "chief, deputies, names, trails, targets and previews",
    "visualization_msgs/MarkerArray",
    every_tick=False,
)
TF = Topic(
    "/tf",
    None,
    "with the markers",
    "the Hill frame in the inertial one, each deputy in the Hill frame",
    "tf2_msgs/TFMessage",
    every_tick=False,
)
TRANSFORMS = Topic(
    "/transforms",
    None,
    "with the markers",
    "the same one by one, where tf2_msgs is not installed",
    "geometry_msgs/TransformStamped",
    every_tick=False,
)

MEASUREMENT = Topic(
    "measurement",
    records.Measurement,
    "every tick",
    "sensor readings, own applied force and mass, the chief's ephemeris",
)
ESTIMATE = Topic(
    "estimate",
    records.Estimate,
    "every tick with a filter state",
    "relative state, covariance, innovations, rejections, unobservable direction",
)
TARGET = Topic(
    "target",
    records.Target,
    "answers each estimate",
    "target state now and over the horizon, coming eclipses of the chief, states of the fleet's other satellites",
)
SEPARATION = Topic(
    "separation",
    records.Separation,
    "in a fleet, every `separation_interval` of simulated time",
    "least predicted distances to the others: along the preview, and if no thruster fires",
    every_tick=False,
    fleet_only=True,
)
THRUST = Topic(
    "thrust", records.Thrust, "answers each estimate with its target", "force from the stamp to the next tick"
)
STATUS = Topic("status", records.Status, "with each thrust", "law in use, demand before the limit, solver, fallback")
MODE = Topic(
    "mode",
    mode_records.ModeState,
    "every tick",
    "mode from the next tick on, sensors, axes and laws that modules do without, force in modes that evade",
)
HEALTH = Topic(
    "health",
    mode_records.HealthReport,
    "when it changes",
    "verdicts of the monitors that are not well, of the tick before",
    every_tick=False,
)
TIMING = Topic(
    "timing",
    records.Timing,
    "after each answer",
    "wall time of a module's computation; the only topic on which two equal runs differ",
)

RUN_TOPICS = (CLOCK, TRUTH, EVENTS, DIAGNOSTICS, PROGRESS, MARKERS, TF, TRANSFORMS)
DEPUTY_TOPICS = (MEASUREMENT, ESTIMATE, TARGET, SEPARATION, THRUST, STATUS, MODE, HEALTH, TIMING)


def deputy_of(name: str) -> str:
    """Deputy in whose namespace a topic or node is; empty for one of the run."""
    return name.rpartition("/")[0].strip("/")


def of_one_publisher(deputy: str) -> list[str]:
    """Full names of the topics with one message at every tick from one node: those of a deputy, or of the run."""
    if not deputy:
        return [CLOCK.name, TRUTH.name]
    return [topic.of(deputy) for topic in DEPUTY_TOPICS if topic.every_tick and topic is not TIMING]


def deputies_in(names: "list[str] | dict[str, Any]") -> list[str]:
    """Deputies that have a measurement among full topic names, sorted."""
    return sorted(deputy_of(name) for name in names if name == MEASUREMENT.of(deputy_of(name)))


def types_of(name: str) -> list[str]:
    """Message types, such as `formation_gnc_msgs/msg/Thrust`, of a run's topic of this full name; none for others."""
    known = [each for each in RUN_TOPICS if each.name == name]
    if "/" not in deputy_of(name):
        known += [each for each in DEPUTY_TOPICS if each.of(deputy_of(name)) == name]
    messages = [each.record.message if each.record else each.message for each in known]
    packages = [message.rpartition("/") for message in messages]
    return [f"{package or 'formation_gnc_msgs'}/msg/{kind}" for package, _, kind in packages]


def formation_of(name: str, type_name: str) -> str | None:
    """Namespace of the formation that a topic of this full name and type belongs to; None for one of no formation."""
    tokens = name.split("/")[1:]
    if name == DIAGNOSTICS.name:
        return None
    within = (index for index in range(len(tokens)) if type_name in types_of("/" + "/".join(tokens[index:])))
    index = next(within, None)
    return None if index is None else "".join(f"/{token}" for token in tokens[:index])
