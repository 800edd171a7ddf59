"""A run as markers and transforms, for RViz and Foxglove."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, TransformStamped
from scipy.spatial.transform import Rotation
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from formation_gnc.common import ANY_ORBIT, CommonParameters, Orbit
from formation_gnc.orbit.frames import hill_rotation
from formation_gnc.parameters import parameter
from formation_gnc.records import SatelliteTruth, Target, Truth
from formation_gnc.types import NANOSECONDS, Vector

COLOURS = ((0.12, 0.47, 0.71), (1.0, 0.5, 0.05), (0.17, 0.63, 0.17), (0.84, 0.15, 0.16), (0.58, 0.4, 0.74))
"""Of the deputies in turn, red, green, blue."""


@dataclass(frozen=True)
class DisplayParameters(CommonParameters):
    """How a run is drawn."""

    chief: Orbit = ANY_ORBIT
    rate: float = parameter(10.0, unit="Hz", above=0.0, maximum=100.0, doc="pictures per second of wall time")
    trail: float = parameter(6000.0, unit="s", minimum=0.0, doc="simulated time that a trail goes back")
    trail_step: float = parameter(30.0, unit="s", above=0.0, doc="simulated time between points of a trail")
    size: float = parameter(
        0.0, unit="m", minimum=0.0, doc="diameter of a satellite's ball; 0 for a fortieth of the formation"
    )


def transforms(truth: Truth) -> Iterator[TransformStamped]:
    """The chief's Hill frame in the inertial one, and each deputy in the Hill frame."""
    turned = Rotation.from_matrix(hill_rotation(truth.chief_state).T).as_quat()
    yield _transform(truth.time, "inertial", "hill", truth.chief_state, turned)
    for deputy in truth.deputies:
        yield _transform(truth.time, "hill", deputy.name, deputy.relative_state, np.array([0.0, 0.0, 0.0, 1.0]))


def _transform(time: int, parent: str, child: str, place: Vector, turned: Vector) -> TransformStamped:
    result = TransformStamped(child_frame_id=child)
    result.header.stamp, result.header.frame_id = _stamp(time), parent
    shift, rotation = result.transform.translation, result.transform.rotation
    shift.x, shift.y, shift.z = place[:3].tolist()
    rotation.x, rotation.y, rotation.z, rotation.w = turned.tolist()
    return result


def markers(
    truth: Truth, targets: dict[str, Target], trails: dict[str, deque[Vector]], size: float
) -> Iterator[Marker]:
    """The chief at the origin, and for each deputy its ball, name and trail, its target and preview."""
    origin = [np.zeros(3)]
    yield _marker(truth.time, "chief", 0, Marker.SPHERE, origin, size, (0.4, 0.4, 0.4), 1.0)
    for index, deputy in enumerate(truth.deputies):
        yield from _of_deputy(truth.time, index, deputy, targets.get(deputy.name), trails, size)


def _of_deputy(
    time: int,
    index: int,
    deputy: SatelliteTruth,
    target: Target | None,
    trails: dict[str, deque[Vector]],
    size: float,
) -> Iterator[Marker]:
    colour, place = COLOURS[index % len(COLOURS)], deputy.relative_state[:3]
    yield _marker(time, "satellites", index, Marker.SPHERE, [place], size, colour, 1.0)
    above = place + np.array([size, 0.0, 0.0])
    name = _marker(time, "names", index, Marker.TEXT_VIEW_FACING, [above], size, colour, 1.0)
    name.text = deputy.name
    yield name
    trail = [*trails.get(deputy.name, ()), place]
    yield _marker(time, "trails", index, Marker.LINE_STRIP, trail, 0.15 * size, colour, 0.6)
    if target is None:
        return
    aim = target.relative_state[:3]
    yield _marker(time, "targets", index, Marker.CUBE, [aim], 0.8 * size, colour, 0.4)
    if len(target.preview):
        ahead = [aim, *target.preview[:, :3]]
        yield _marker(time, "previews", index, Marker.LINE_STRIP, ahead, 0.08 * size, colour, 0.4)


def _marker(
    time: int,
    group: str,
    index: int,
    kind: int,
    places: list[Vector],
    size: float,
    colour: tuple[float, float, float],
    opacity: float,
) -> Marker:
    """A ball, cube or text at one place, or a line of several; `size` is its diameter, height or width, m."""
    red, green, blue = colour
    marker = Marker(ns=group, id=index, type=kind, action=Marker.ADD)
    marker.header.stamp, marker.header.frame_id = _stamp(time), "hill"
    marker.color = ColorRGBA(r=red, g=green, b=blue, a=opacity)
    marker.scale.x = size
    marker.pose.orientation.w = 1.0
    if kind == Marker.LINE_STRIP:
        marker.points = [_point(place) for place in places]
    else:
        marker.scale.y = marker.scale.z = size
        marker.pose.position = _point(places[0])
    return marker


def _point(place: Vector) -> Point:
    x, y, z = place.tolist()
    return Point(x=x, y=y, z=z)


def _stamp(time: int) -> Time:
    seconds, nanoseconds = divmod(time, NANOSECONDS)
    return Time(sec=seconds, nanosec=nanoseconds)
