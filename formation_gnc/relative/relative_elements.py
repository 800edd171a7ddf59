"""Quasi-nonsingular relative orbital elements: their maps to and from the Hill state, and their transition matrices.

With u = M + omega the mean argument of latitude, of a deputy about a chief, times the chief's semi-major axis a so that
all six are in metres (D'Amico 2010; Koenig, Guffanti and D'Amico 2017):

    da = a_d - a_c,                      dlambda = a (u_d - u_c + (Omega_d - Omega_c) cos i_c),
    dex, dey = a (e_d [cos, sin] omega_d - e_c [cos, sin] omega_c),
    dix, diy = a (i_d - i_c, (Omega_d - Omega_c) sin i_c)

The maps of elements are exact, at any eccentricity and separation; matrices are of first order in the separation.
Elements are osculating or mean ones as the orbits are that they are formed of; mean ones drift as the transition
matrices say. A chief without a node (within a milliradian of the equator) has none: OrbitError.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from formation_gnc.errors import OrbitError
from formation_gnc.orbit.elements import (
    Elements,
    elements_from_state,
    state_from_elements,
    true_from_mean_anomaly,
    wrap,
)
from formation_gnc.orbit.frames import inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.mean import advanced, mean_elements, osculating_state, secular_rates
from formation_gnc.relative.element_differences import (
    check_node,
    secular_slopes,
    secular_transition,
    sigma,
    true_from_mean_latitude,
)
from formation_gnc.relative.model import Array

NAMES = ("da", "dlambda", "dex", "dey", "dix", "diy")
"""Of the six elements, in order."""


def relative_elements(chief: Elements, deputy: Elements) -> Array:
    """(6,) relative elements of a deputy, m, angles the short way round.

    Raises:
        OrbitError: a chief without a node.
    """
    check_node(chief, "relative elements")
    node = _short_way(deputy.right_ascension - chief.right_ascension)
    latitude = _short_way(_mean_latitude(deputy) - _mean_latitude(chief))
    (chief_x, chief_y), (deputy_x, deputy_y) = _eccentricity_vector(chief), _eccentricity_vector(deputy)
    return chief.semi_major_axis * np.array(
        [
            deputy.semi_major_axis / chief.semi_major_axis - 1.0,
            latitude + node * math.cos(chief.inclination),
            deputy_x - chief_x,
            deputy_y - chief_y,
            deputy.inclination - chief.inclination,
            node * math.sin(chief.inclination),
        ]
    )


def deputy_elements(chief: Elements, relative: Array) -> Elements:
    """Elements of a deputy from its relative elements (6,), m: the inverse of `relative_elements`.

    Raises:
        OrbitError: a chief without a node, or a deputy on no orbit about the Earth.
    """
    check_node(chief, "relative elements")
    if not np.isfinite(relative).all():
        raise OrbitError(f"relative elements are {np.asarray(relative).tolist()} m: they must be finite")
    axis, along, ex, ey, tilt, node = (np.asarray(relative) / chief.semi_major_axis).tolist()
    turned = node / math.sin(chief.inclination)
    chief_x, chief_y = _eccentricity_vector(chief)
    x, y = chief_x + ex, chief_y + ey
    perigee = math.atan2(y, x)
    anomaly = _mean_latitude(chief) + along - turned * math.cos(chief.inclination) - perigee
    eccentricity = math.hypot(x, y)
    return Elements(
        chief.semi_major_axis * (1.0 + axis),
        eccentricity,
        chief.inclination + tilt,
        wrap(chief.right_ascension + turned),
        wrap(perigee),
        true_from_mean_anomaly(anomaly, eccentricity),  # an open orbit is rejected by its name
    )


def osculating_relative_elements(chief: Array, state: Array) -> Array:
    """(6,) osculating relative elements, m, of a relative state (6,), Hill frame, about a chief's inertial state (6,).

    Raises:
        OrbitError: chief or deputy is on no orbit about the Earth, or the chief has no node.
    """
    return relative_elements(elements_from_state(chief), elements_from_state(inertial_from_relative(chief, state)))


def mean_relative_elements(chief: Array, state: Array) -> Array:
    """As `osculating_relative_elements`, of the mean orbits of chief and deputy under J2."""
    orbits = [mean_elements(elements_from_state(each)) for each in (chief, inertial_from_relative(chief, state))]
    return relative_elements(*orbits)


def state_from_osculating(chief: Array, relative: Array) -> Array:
    """(6,) relative state, Hill frame, m and m/s: the inverse of `osculating_relative_elements`."""
    return relative_from_inertial(chief, state_from_elements(deputy_elements(elements_from_state(chief), relative)))


def state_from_mean(chief: Array, relative: Array) -> Array:
    """(6,) relative state, Hill frame, m and m/s: the inverse of `mean_relative_elements`."""
    deputy = deputy_elements(mean_elements(elements_from_state(chief)), relative)
    return relative_from_inertial(chief, osculating_state(state_from_elements(deputy)))


def hill_matrix(chief: Elements) -> Array:
    """(6, 6) map from relative elements, m, to the relative state, Hill frame, at any eccentricity of the chief.

    Both are osculating, or both of the mean orbits; raises OrbitError for a chief without a node.
    """
    check_node(chief, "relative elements")
    matrix: Array = sigma(chief) @ true_from_mean_latitude(chief) @ _differences(chief)
    return matrix


def near_circular_matrix(latitude: ArrayLike, mean_motion: float) -> Array:
    """(..., 6, 6) maps from relative elements, m, to the relative state, Hill frame, about a near-circular chief.

    Neglects the chief's eccentricity, and with it needs no node: latitudes (...,) (rad) count from wherever the
    elements do.
    """
    sine, cosine, n = np.sin(latitude), np.cos(latitude), mean_motion
    matrix = np.zeros((*np.shape(latitude), 6, 6))
    matrix[..., 0, 0] = matrix[..., 1, 1] = 1.0
    matrix[..., 4, 0] = -1.5 * n
    matrix[..., 0, 2], matrix[..., 0, 3] = -cosine, -sine
    matrix[..., 1, 2], matrix[..., 1, 3] = 2.0 * sine, -2.0 * cosine
    matrix[..., 2, 4], matrix[..., 2, 5] = sine, -cosine
    matrix[..., 3, 2], matrix[..., 3, 3] = n * sine, -n * cosine
    matrix[..., 4, 2], matrix[..., 4, 3] = 2.0 * n * cosine, 2.0 * n * sine
    matrix[..., 5, 4], matrix[..., 5, 5] = n * cosine, n * sine
    return matrix


def near_circular_elements(latitude: float, mean_motion: float, state: Array) -> Array:
    """(..., 6) relative elements, m, of relative states (..., 6): the inverse of `near_circular_matrix`."""
    x, y, z, vx, vy, vz = np.moveaxis(np.asarray(state) / np.repeat([1.0, mean_motion], 3), -1, 0)
    sine, cosine = math.sin(latitude), math.cos(latitude)
    along, across = 3.0 * x + 2.0 * vy, vx
    elements: Array = np.stack(
        [
            4.0 * x + 2.0 * vy,
            y - 2.0 * vx,
            cosine * along + sine * across,
            sine * along - cosine * across,
            sine * z + cosine * vz,
            -cosine * z + sine * vz,
        ],
        axis=-1,
    )
    return elements


def kepler_transition(chief: Elements, duration: float) -> Array:
    """(6, 6) transition matrix of relative elements without perturbations, over a duration, s."""
    matrix = np.eye(6)
    matrix[1, 0] = -1.5 * chief.mean_motion * duration
    return matrix


def j2_transition(chief: Elements, duration: float) -> Array:
    """(6, 6) transition matrix of mean relative elements under J2, over a duration, s.

    Koenig, Guffanti and D'Amico's for arbitrary eccentricity: the secular rates of the mean elements, to first order
    in their differences; a group, since the eccentricity vectors turn with the perigee.

    Args:
        chief: its mean elements at the start.
        duration: s.
    """
    of_elements = _differences(chief)
    return np.asarray(np.linalg.solve(of_elements, secular_transition(chief, duration) @ of_elements))


def drag_response(chief: Elements, duration: float) -> Array:
    """(6,) mean relative elements after a duration per rate of da by differential drag, s, from zero, under J2.

    Koenig, Guffanti and D'Amico's model without a model of the density: the rate (m/s) is constant and known, say
    estimated; the perigee radius stays, which couples the eccentricity to it. The transition under J2 with
    differential drag is that of `j2_transition`, plus this times the rate.

    Assumes: the chief's own decay does not change the rates.
    """
    e, omega, axis = chief.eccentricity, chief.argument_of_perigee, chief.semi_major_axis
    kept = (1.0 - e) / axis
    source = np.array([1.0, 0.0, 0.0, kept * math.cos(omega), kept * math.sin(omega), 0.0])
    later = omega + secular_rates(chief)[1] * duration
    slopes = secular_slopes(chief) @ source * (0.5 * duration**2)
    response = duration * source
    response[[1, 5]] += slopes[[1, 5]]
    response[3] = kept * duration * math.cos(later) - e * math.sin(later) * slopes[3]
    response[4] = kept * duration * math.sin(later) + e * math.cos(later) * slopes[3]
    return np.asarray(np.linalg.solve(_differences(chief), response))


def drifted(chief: Elements, relative: Array, duration: float) -> Array:
    """(6,) mean relative elements, m, after a duration, s, under J2: as `j2_transition`, at any separation.

    Args:
        chief: its mean elements at the start.
        relative: (6,) mean relative elements at the start, m.
        duration: s.
    """
    deputy = deputy_elements(chief, relative)
    node, perigee, anomaly = np.subtract(secular_rates(deputy), secular_rates(chief)).tolist()
    later = [advanced(orbit, duration) for orbit in (chief, deputy)]
    (chief_x, chief_y), (deputy_x, deputy_y) = (_eccentricity_vector(orbit) for orbit in later)
    a, gone = chief.semi_major_axis, chief.semi_major_axis * duration
    moved = np.array(relative, dtype=np.float64)
    moved[1] += gone * (perigee + anomaly + node * math.cos(chief.inclination))
    moved[2:4] = a * (deputy_x - chief_x), a * (deputy_y - chief_y)
    moved[5] += gone * node * math.sin(chief.inclination)
    return moved


def with_drift(chief: Elements, relative: Array, rate: float = 0.0) -> Array:
    """(6,) mean relative elements, m, with the da by which dlambda drifts at a rate (m/s) under J2.

    Args:
        chief: its mean elements.
        relative: (6,), m; da is replaced.
        rate: of dlambda, m/s.
    """
    result = np.array(relative, dtype=np.float64)
    for _ in range(20):  # Newton's method with the slope without J2
        change = (drifted(chief, result, 1.0)[1] - result[1] - rate) / (1.5 * chief.mean_motion)
        result[0] += change
        if abs(change) < 1e-9:
            break
    return result


def least_separation(relative: Array) -> float:
    """Least distance (m) from the chief's track across the flight direction, in free motion near a circular chief.

    With the relative eccentricity and inclination vectors e and i the distance in the radial/cross-track plane is
    never below sqrt(2) |e . i| / sqrt(e^2 + i^2 + |e + i| |e - i|) (D'Amico and Montenbruck 2006), the smaller of
    both where they are parallel; a difference of semi-major axes shifts the ellipse, and takes up to its size off.
    """
    axis, _, *vectors = np.asarray(relative, dtype=np.float64)
    e, i = np.array(vectors[:2]), np.array(vectors[2:])
    span = e @ e + i @ i + np.linalg.norm(e + i) * np.linalg.norm(e - i)
    if span == 0.0:
        return 0.0
    return max(0.0, float(math.sqrt(2.0) * abs(e @ i) / math.sqrt(span)) - abs(float(axis)))


def _differences(chief: Elements) -> Array:
    """(6, 6) map from relative elements, m, to differences of [a, lambda, i, q1, q2, Omega]."""
    per_metre = 1.0 / chief.semi_major_axis
    matrix = np.zeros((6, 6))
    matrix[0, 0] = 1.0
    matrix[1, 1] = matrix[3, 2] = matrix[4, 3] = matrix[2, 4] = per_metre
    matrix[5, 5] = per_metre / math.sin(chief.inclination)
    matrix[1, 5] = -math.cos(chief.inclination) * matrix[5, 5]
    return matrix


def _mean_latitude(orbit: Elements) -> float:
    return orbit.mean_anomaly + orbit.argument_of_perigee


def _eccentricity_vector(orbit: Elements) -> tuple[float, float]:
    e, omega = orbit.eccentricity, orbit.argument_of_perigee
    return e * math.cos(omega), e * math.sin(omega)


def _short_way(angle: float) -> float:
    return math.remainder(angle, math.tau)
