"""Which formation a topic belongs to, by its name and type."""

import pytest

from formation_gnc.flight.topics import formation_of, types_of


@pytest.mark.parametrize(
    ("name", "kind", "formation"),
    [
        ("/clock", "rosgraph_msgs/msg/Clock", ""),
        ("/alpha/clock", "rosgraph_msgs/msg/Clock", "/alpha"),
        ("/alpha/recorder/progress", "rosgraph_msgs/msg/Clock", "/alpha"),
        ("/deputy1/estimate", "formation_gnc_msgs/msg/Estimate", ""),
        ("/a/b/deputy1/estimate", "formation_gnc_msgs/msg/Estimate", "/a/b"),
        ("/deputy1/estimate", "std_msgs/msg/String", None),
        ("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", None),
        ("/camera/image", "sensor_msgs/msg/Image", None),
        ("/estimate", "formation_gnc_msgs/msg/Estimate", None),
    ],
)
def test_a_topic_belongs_to_the_formation_above_it(name: str, kind: str, formation: str | None) -> None:
    assert formation_of(name, kind) == formation


def test_types_of_topics_are_those_of_their_records() -> None:
    assert types_of("/deputy1/thrust") == ["formation_gnc_msgs/msg/Thrust"]
    assert types_of("/truth") == ["formation_gnc_msgs/msg/Truth"]
    assert types_of("/a/deputy1/thrust") == types_of("/thrust") == types_of("/x") == []
