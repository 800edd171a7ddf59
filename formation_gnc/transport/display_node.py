"""The display node: a run as markers and transforms, for RViz and Foxglove.

Nobody waits for it: a few times a second of wall time it draws the latest truth and targets.
"""

from collections import deque
from collections.abc import Callable
from functools import partial

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import TransformStamped
from visualization_msgs.msg import MarkerArray

from formation_gnc.flight import topics
from formation_gnc.flight.reception import Information, figures
from formation_gnc.records import Target, Truth
from formation_gnc.transport.diagnostics import PERIOD, DiagnosticsPublisher
from formation_gnc.transport.markers import DisplayParameters, markers, transforms
from formation_gnc.transport.node import ConfiguredNode
from formation_gnc.transport.qos import quality
from formation_gnc.types import NANOSECONDS, Vector


class DisplayNode(ConfiguredNode):
    """Draws the chief's Hill frame with the deputies, their trails, targets and previews.

    Markers are in the frame `hill`. Transforms, inertial to hill and hill to each deputy, go to `/tf` where
    tf2_msgs is installed, and one by one to `/transforms` elsewhere.
    """

    def __init__(self) -> None:
        """Subscribe to the truth, and to the targets of the deputies in it."""
        super().__init__("display", DisplayParameters)
        self._marker_publisher = self.create_publisher(MarkerArray, self.full_name(topics.MARKERS.name), quality())
        self._publish_transforms = self._transform_publisher()
        self._truth: Truth | None = None
        self._targets: dict[str, Target | None] = {}
        self._trails: dict[str, deque[Vector]] = {}
        self._trail_time = -1
        self.subscribe(Truth, topics.TRUTH.name, self._on_truth)
        self._diagnostics = DiagnosticsPublisher(self, self.full_name("") or "/")
        self.create_wall_timer(PERIOD, self._diagnose)
        self.create_wall_timer(1.0 / self.values.rate, self._draw)

    def _transform_publisher(self) -> Callable[[list[TransformStamped]], object]:
        try:
            from tf2_msgs.msg import TFMessage
        except ImportError:
            single = self.create_publisher(TransformStamped, self.full_name(topics.TRANSFORMS.name), quality())
            return lambda transforms: [single.publish(each) for each in transforms]
        together = self.create_publisher(TFMessage, self.full_name(topics.TF.name), quality())
        return lambda transforms: together.publish(TFMessage(transforms=transforms))

    def _on_truth(self, truth: Truth, _: Information) -> None:
        self._truth = truth
        time = truth.time
        if time < self._trail_time:  # another run
            self._trails.clear()
        if time < self._trail_time or time - self._trail_time >= self.values.trail_step * NANOSECONDS:
            self._trail_time = time
            points = max(1, round(self.values.trail / self.values.trail_step))
            for deputy in truth.deputies:
                trail = self._trails.setdefault(deputy.name, deque(maxlen=points))
                trail.append(deputy.relative_state[:3])

    def _on_target(self, deputy: str, target: Target, _: Information) -> None:
        self._targets[deputy] = target

    def simulated_time(self) -> int:
        """Stamp (ns) of the latest point of the trails."""
        return max(0, self._trail_time)

    def _diagnose(self) -> None:
        is_waiting = self._trail_time < 0
        level = DiagnosticStatus.WARN if is_waiting else DiagnosticStatus.OK
        message = f"waiting for {topics.TRUTH.name}" if is_waiting else "drawing"
        self._diagnostics.publish(
            level, message, {"satellites": len(self._targets) + 1, **figures(self.receptions)}, self._trail_time
        )

    def _draw(self) -> None:
        """Publish the latest, if there is any."""
        if self._truth is None:
            return
        truth, self._truth = self._truth, None
        for deputy in truth.deputies:
            if deputy.name not in self._targets:
                self._targets[deputy.name] = None
                self.subscribe(Target, topics.TARGET.of(deputy.name), partial(self._on_target, deputy.name))
        targets = {name: target for name, target in self._targets.items() if target}
        distances = [float(np.linalg.norm(each.relative_state[:3])) for each in truth.deputies]
        size = self.values.size or max(1.0, max(distances, default=0.0) / 40.0)
        self._publish_transforms(list(transforms(truth)))
        self._marker_publisher.publish(MarkerArray(markers=list(markers(truth, targets, self._trails, size))))
