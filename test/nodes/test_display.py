"""What the display node draws is where the satellites are."""

from collections import deque

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from visualization_msgs.msg import Marker

from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.frames import inertial_from_relative
from formation_gnc.records import SatelliteTruth, Target, Truth
from formation_gnc.transport.markers import markers, transforms
from formation_gnc.types import NANOSECONDS

TIME = 90 * NANOSECONDS + 500_000_000


@pytest.fixture
def truth() -> Truth:
    chief = state_from_elements(Elements(7.0e6, 0.01, 1.2, 0.3, 0.4, 0.5))
    deputies = []
    for index in range(2):
        relative = np.array([10.0, -100.0 * (index + 1), 30.0, 0.01, 0.02, 0.03])
        inertial = inertial_from_relative(chief, relative)
        deputies.append(SatelliteTruth(f"deputy{index + 1}", inertial, relative, np.zeros(3), 100.0, False))
    return Truth(TIME, chief, deputies)


def xyz(vector: object) -> list[float]:
    return [vector.x, vector.y, vector.z]  # type: ignore[attr-defined]


def test_transforms_chain_to_the_inertial_position_of_the_deputy(truth: Truth) -> None:
    hill, *deputies = transforms(truth)
    assert (hill.header.frame_id, hill.child_frame_id) == ("inertial", "hill")
    assert (hill.header.stamp.sec, hill.header.stamp.nanosec) == (90, 500_000_000)
    turn = hill.transform.rotation
    rotation = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w])
    for transform, deputy in zip(deputies, truth.deputies, strict=True):
        assert (transform.header.frame_id, transform.child_frame_id) == ("hill", deputy.name)
        place = xyz(hill.transform.translation) + rotation.apply(xyz(transform.transform.translation))
        assert place == pytest.approx(deputy.inertial_state[:3], abs=1e-6)


def test_every_deputy_has_markers_and_a_target_where_there_is_one(truth: Truth) -> None:
    target = Target(TIME, "ring", np.array([1.0, 2.0, 3.0, 0.0, 0.0, 0.0]), 60 * NANOSECONDS, np.ones((4, 6)))
    past = np.array([0.0, -90.0, 30.0])
    drawn = list(markers(truth, {"deputy2": target}, {"deputy1": deque([past])}, 5.0))
    assert {marker.header.frame_id for marker in drawn} == {"hill"}
    assert len({(marker.ns, marker.id) for marker in drawn}) == len(drawn)  # or one would replace another
    by_name = {(marker.ns, marker.id): marker for marker in drawn}
    assert by_name["names", 1].text == "deputy2"
    assert xyz(by_name["satellites", 0].pose.position) == truth.deputies[0].relative_state[:3].tolist()
    trail = by_name["trails", 0]
    assert (trail.type, [xyz(point) for point in trail.points]) == (
        Marker.LINE_STRIP,
        [past.tolist(), truth.deputies[0].relative_state[:3].tolist()],
    )
    assert xyz(by_name["targets", 1].pose.position) == [1.0, 2.0, 3.0]
    assert len(by_name["previews", 1].points) == 5
    assert ("targets", 0) not in by_name
