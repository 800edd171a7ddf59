"""Constraints on the path of a plan, met by cuts: half-spaces and cones at the samples of a path that violates them.

A sample is where the deputy is at the end of step j if step k is the last with thrust: the path itself for k = j, and
for k < j the coasting that follows when a burn has been the last.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from formation_gnc.control.cone_programme import ConeProgramme, Rows
from formation_gnc.control.thrust_response import ThrustResponse
from formation_gnc.types import Matrix, Vector

TOLERANCE = 1e-3
"""Largest violation that counts as met, of the radius, the range or the speed."""

NEAR = 2.0
"""Radii of a keep-out sphere within which all of a path that violates it gets half-spaces."""


@dataclass
class Path:
    """Motion to constrain, by accelerations in multiples of a unit (m/s^2)."""

    response: ThrustResponse
    start: Vector
    """(6,) relative state, m and m/s."""
    unit: float

    def rows(self, start: Vector, step: int, last: int, part: slice) -> Rows:
        """Part of the state at the end of a step by the forces of the steps before `last`."""
        free = self.response.free[step][part]
        matrix = np.zeros((len(free), 3 * self.response.count))
        pushed = self.unit * np.einsum("ij,kjl->ikl", free, self.response.pushed[:last])
        matrix[:, : 3 * last] = pushed.reshape(len(free), -1)
        return matrix, free @ start


class PathConstraint(ABC):
    """Adds the cuts that a path asks for; those once added stay."""

    @abstractmethod
    def cut(self, path: Path, accelerations: Matrix, programme: ConeProgramme) -> float:
        """Add cuts where accelerations (N, 3), m/s^2, violate the constraint; the largest violation, relative."""


@dataclass
class KeepOut(PathConstraint):
    """Spheres about satellites that move freely, met by half-spaces whose normals rotate along the path.

    Outside the sphere the normal points to the path; where the path is inside, it turns evenly from where it enters
    to where it leaves.
    """

    radius: float
    centres: Matrix
    """(C, 6) states of the centres at the start."""
    coasting: int
    """Steps for which the coasting after each burn is kept outside too."""
    done: set[tuple[int, int, int]] = field(default_factory=set)

    def cut(self, path: Path, accelerations: Matrix, programme: ConeProgramme) -> float:
        """The path first, and the coasting after it once that is outside."""
        response, worst = path.response, 0.0
        for centre, other in enumerate(self.centres):
            origins = response.origins(path.start - other, accelerations)
            steps = np.arange(1, response.count + 1)
            places = np.einsum("kij,kj->ki", response.free[steps, :3], origins[steps])
            worst = max(worst, self._along(path, other, programme, (centre, steps, steps, places)))
            for last in range(1, response.count + 1) if self.coasting else ():
                ends = last + np.arange(1, self.coasting + 1)
                places = response.free[ends, :3] @ origins[last]
                worst = max(
                    worst, self._along(path, other, programme, (centre, ends, np.full(len(ends), last), places))
                )
        return worst

    def _along(
        self,
        path: Path,
        other: Vector,
        programme: ConeProgramme,
        samples: tuple[int, NDArray[np.int_], NDArray[np.int_], Matrix],
    ) -> float:
        """Cuts along one path, by its centre, steps, last steps with thrust and places (M, 3)."""
        centre, steps, lasts, places = samples
        distances = np.linalg.norm(places, axis=1)
        violation = 1.0 - float(distances.min()) / self.radius
        if violation <= TOLERANCE:
            return max(violation, 0.0)
        normals = rotating_normals(places, distances, self.radius)
        for index in np.flatnonzero(distances < NEAR * self.radius).tolist():
            key = centre, int(steps[index]), int(lasts[index])
            if key in self.done:
                continue
            self.done.add(key)
            rows, constant = path.rows(path.start - other, key[1], key[2], slice(0, 3))
            normal = normals[index]
            cut = (normal @ rows)[None] / self.radius, np.array([normal @ constant / self.radius - 1.0])
            programme.above.append(cut)
        return violation


def rotating_normals(places: Matrix, distances: Vector, radius: float) -> Matrix:
    """(M, 3) unit vectors to places (M, 3), which turn evenly over each stretch inside a sphere."""
    normals = places / np.maximum(distances, 1e-9)[:, None]
    inside = distances < radius
    index = 0
    while index < len(places):
        if not inside[index]:
            index += 1
            continue
        end = index
        while end < len(places) and inside[end]:
            end += 1
        before, after = index - 1, end if end < len(places) else -1
        if before >= 0 and after >= 0:
            shares = (np.arange(index, end) - before) / (after - before)
            normals[index:end] = turned(normals[before], normals[after], shares)
        elif before >= 0 or after >= 0:
            normals[index:end] = normals[max(before, after)]
        index = end
    return normals


def turned(first: Vector, last: Vector, shares: Vector) -> Matrix:
    """(M, 3) unit vectors on the way from one unit vector (3,) to another, at shares (M,) of the angle."""
    axis = np.cross(first, last)
    sine, cosine = float(np.linalg.norm(axis)), float(first @ last)
    if sine < 1e-9:  # on opposite sides, or together: by any way across
        axis = np.cross(first, np.eye(3)[int(np.argmin(np.abs(first)))])
    axis = axis / np.linalg.norm(axis)
    angles = math.atan2(sine, cosine) * shares
    return np.cos(angles)[:, None] * first + np.sin(angles)[:, None] * np.cross(axis, first)


@dataclass
class ApproachCone(PathConstraint):
    """Cone with its tip at the chief, in which the path stays within a range."""

    axis: Vector
    """(3,) unit vector from the tip, Hill frame."""
    half_angle: float
    range: float
    done: set[int] = field(default_factory=set)

    def cut(self, path: Path, accelerations: Matrix, programme: ConeProgramme) -> float:
        """A cone for every sample in range, once one is outside."""
        steps, places = _states(path, accelerations, slice(0, 3))
        near = np.linalg.norm(places, axis=1) < self.range
        slope = math.tan(self.half_angle)
        ahead = places @ self.axis
        aside = np.linalg.norm(places - np.outer(ahead, self.axis), axis=1)
        violation = float(np.max((aside - slope * ahead)[near], initial=0.0)) / self.range
        if violation <= TOLERANCE:
            return violation
        across = np.eye(3) - np.outer(self.axis, self.axis)
        form = np.vstack([slope * self.axis, across]) / self.range
        _add(path, programme, self.done, steps[near], form, np.zeros(4))
        return violation


@dataclass
class SpeedLimit(PathConstraint):
    """Largest relative speed within a range of the chief."""

    speed: float
    range: float
    done: set[int] = field(default_factory=set)

    def cut(self, path: Path, accelerations: Matrix, programme: ConeProgramme) -> float:
        """A limit for every sample in range, once one is faster."""
        steps, states = _states(path, accelerations, slice(0, 6))
        near = np.linalg.norm(states[:, :3], axis=1) < self.range
        violation = float(np.max(np.linalg.norm(states[near, 3:], axis=1), initial=0.0)) / self.speed - 1.0
        if violation <= TOLERANCE:
            return max(violation, 0.0)
        form = np.hstack([np.zeros((4, 3)), np.vstack([np.zeros(3), np.eye(3)])]) / self.speed
        _add(path, programme, self.done, steps[near], form, np.array([1.0, 0.0, 0.0, 0.0]))
        return violation


def _states(path: Path, accelerations: Matrix, part: slice) -> tuple[NDArray[np.int_], Matrix]:
    """Steps (N,) and a part of the states at their ends (N, n)."""
    steps = np.arange(1, path.response.count + 1)
    origins = path.response.origins(path.start, accelerations)
    return steps, np.einsum("kij,kj->ki", path.response.free[steps, part], origins[steps])


def _add(
    path: Path, programme: ConeProgramme, done: set[int], steps: NDArray[np.int_], form: Matrix, constant: Vector
) -> None:
    """Cones |y[1:]| <= y[0] of y = form x + constant at the ends of steps that have none."""
    for step in steps.tolist():
        if step not in done:
            done.add(step)
            rows, free = path.rows(path.start, step, step, slice(0, form.shape[1]))
            programme.cones.append((form @ rows, form @ free + constant))
