"""Inertial frame and the chief's Hill frame.

An inertial state is ``[r, v]``, six numbers in m and m/s, Earth-centred. The Hill frame is centred on the
chief: x radial outwards, y along-track, z along the orbit normal ``r x v``. Written out by component for speed:
these functions run at every tick.

Convention: relative velocities are those in a frame that rotates at ``h / r^2`` about the orbit normal. That
rate follows from the chief's position and velocity alone, at any eccentricity, so the transformation is the same
for every force model and inverts exactly. An out-of-plane acceleration ``a_z`` also tilts the orbit plane, at
``r a_z / h`` about the radial axis (J2 in LEO: up to about 1e-6 rad/s, 0.1 mm/s at 100 m). The velocities here
exclude that tilt, and so differ from the time derivative of the Hill coordinates by its cross product with the
position. `hill_angular_velocity` includes it.
"""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from formation_gnc.errors import OrbitError
from formation_gnc.orbit.jit import ANY_MATRIX, ANY_VECTOR, inline, kernel

Array = NDArray[np.float64]


@inline
def hill_frame(chief: Array) -> tuple[Array, float]:
    """`hill_rotation` and `hill_rate` for use inside kernels; NaN where there is no orbit plane."""
    rx, ry, rz, vx, vy, vz = chief[0], chief[1], chief[2], chief[3], chief[4], chief[5]
    hx, hy, hz = ry * vz - rz * vy, rz * vx - rx * vz, rx * vy - ry * vx
    square = rx * rx + ry * ry + rz * rz
    radius, momentum = sqrt(square), sqrt(hx * hx + hy * hy + hz * hz)
    rate = momentum / square
    rx, ry, rz = rx / radius, ry / radius, rz / radius
    hx, hy, hz = hx / momentum, hy / momentum, hz / momentum
    axes = np.empty((3, 3))
    axes[0, 0], axes[0, 1], axes[0, 2] = rx, ry, rz
    axes[1, 0], axes[1, 1], axes[1, 2] = hy * rz - hz * ry, hz * rx - hx * rz, hx * ry - hy * rx
    axes[2, 0], axes[2, 1], axes[2, 2] = hx, hy, hz
    return axes, rate


def hill_rotation(chief: Array) -> Array:
    """Rotation from inertial to Hill components.

    Args:
        chief: inertial state of the chief, (6,), m and m/s.

    Returns:
        (3, 3); its rows are the Hill axes x, y, z in inertial components.

    Raises:
        OrbitError: no orbit plane (zero radius or rectilinear motion).
    """
    rx, ry, rz, vx, vy, vz = map(float, chief)
    hx, hy, hz = ry * vz - rz * vy, rz * vx - rx * vz, rx * vy - ry * vx
    radius = sqrt(rx * rx + ry * ry + rz * rz)
    momentum = sqrt(hx * hx + hy * hy + hz * hz)
    if not (radius > 0.0 and momentum > 0.0):
        raise OrbitError(
            f"chief state {list(map(float, chief))} has no orbit plane: radius and angular momentum must be above zero"
        )
    rx, ry, rz = rx / radius, ry / radius, rz / radius
    hx, hy, hz = hx / momentum, hy / momentum, hz / momentum
    return np.array(
        [[rx, ry, rz], [hy * rz - hz * ry, hz * rx - hx * rz, hx * ry - hy * rx], [hx, hy, hz]],
        dtype=np.float64,
    )


def hill_rate(chief: Array) -> float:
    """Rate of the Hill frame about the orbit normal, ``h / r^2``, rad/s.

    Args:
        chief: inertial state of the chief, (6,), m and m/s.
    """
    rx, ry, rz, vx, vy, vz = map(float, chief)
    hx, hy, hz = ry * vz - rz * vy, rz * vx - rx * vz, rx * vy - ry * vx
    return sqrt(hx * hx + hy * hy + hz * hz) / (rx * rx + ry * ry + rz * rz)


def hill_angular_velocity(chief: Array, acceleration: Array) -> Array:
    """Angular velocity of the Hill frame, tilt of the orbit plane included, in Hill components.

    Args:
        chief: inertial state of the chief, (6,), m and m/s.
        acceleration: its total inertial acceleration, (3,), m/s^2.

    Returns:
        (3,) ``[r a_z / h, 0, h / r^2]``, rad/s.
    """
    rate = hill_rate(chief)
    radius = sqrt(sum(float(r) ** 2 for r in chief[:3]))
    out_of_plane = float(hill_rotation(chief)[2] @ acceleration)
    return np.array([out_of_plane / (radius * rate), 0.0, rate])


@kernel((ANY_VECTOR, ANY_MATRIX, ANY_VECTOR))
def inertial_acceleration(chief: Array, forces: Array, masses: Array) -> Array:
    """Inertial accelerations by forces along the chief's Hill axes.

    Args:
        chief: inertial state of the chief, (6,), m and m/s.
        forces: one for each satellite, (N, 3), Hill frame, N.
        masses: of the satellites, (N,), kg.

    Returns:
        (N, 3), inertial frame, m/s^2.
    """
    axes, _ = hill_frame(chief)
    out = np.empty(forces.shape)
    for k in range(len(masses)):
        x, y, z = forces[k, 0] / masses[k], forces[k, 1] / masses[k], forces[k, 2] / masses[k]
        for c in range(3):
            out[k, c] = x * axes[0, c] + y * axes[1, c] + z * axes[2, c]
    return out


def hill_transform(chief: Array) -> Array:
    """Transformation of inertial differences (deputy minus chief) to relative states in the Hill frame.

    Linear, and exact at any separation; a covariance P of the difference becomes ``T P T'``.

    Args:
        chief: inertial state of the chief, (6,), m and m/s.

    Returns:
        (6, 6).
    """
    rotation, rate = hill_rotation(chief), hill_rate(chief)
    transform = np.zeros((6, 6))
    transform[:3, :3] = transform[3:, 3:] = rotation
    transform[3, :3] = rate * rotation[1]
    transform[4, :3] = -rate * rotation[0]
    return transform


def hill_transform_inverse(chief: Array) -> Array:
    """Inverse of `hill_transform`: relative states in the Hill frame to inertial differences, (6, 6)."""
    rotation, rate = hill_rotation(chief), hill_rate(chief)
    transform = np.zeros((6, 6))
    transform[:3, :3] = transform[3:, 3:] = rotation.T
    transform[3:, 0] = rate * rotation[1]
    transform[3:, 1] = -rate * rotation[0]
    return transform


def relative_from_inertial(chief: Array, deputy: Array) -> Array:
    """Relative state of a deputy in the chief's Hill frame; exact, for any eccentricity and separation.

    Args:
        chief: inertial state of the chief, (6,), m and m/s.
        deputy: inertial state of the deputy, (6,), m and m/s.

    Returns:
        ``[x, y, z, vx, vy, vz]``, (6,), m and m/s.
    """
    rotation, rate = hill_rotation(chief), hill_rate(chief)
    relative = np.empty(6)
    relative[:3] = rotation @ (deputy[:3] - chief[:3])
    relative[3:] = rotation @ (deputy[3:] - chief[3:])
    relative[3] += rate * relative[1]
    relative[4] -= rate * relative[0]
    return relative


def inertial_from_relative(chief: Array, relative: Array) -> Array:
    """Inertial state of a deputy from its relative state: the inverse of `relative_from_inertial`.

    Args:
        chief: inertial state of the chief, (6,), m and m/s.
        relative: relative state in the chief's Hill frame, (6,), m and m/s.

    Returns:
        Inertial state of the deputy, (6,), m and m/s.
    """
    rotation, rate = hill_rotation(chief), hill_rate(chief)
    velocity = np.array([relative[3] - rate * relative[1], relative[4] + rate * relative[0], relative[5]])
    deputy = np.empty(6)
    deputy[:3] = chief[:3] + relative[:3] @ rotation
    deputy[3:] = chief[3:] + velocity @ rotation
    return deputy


@inline
def to_inertial(axes: Array, rate: float, chief: Array, relative: Array) -> Array:
    """`inertial_from_relative` for use inside kernels, with the `hill_frame` of the chief."""
    vx, vy, vz = relative[3] - rate * relative[1], relative[4] + rate * relative[0], relative[5]
    deputy = np.empty(6)
    for c in range(3):
        deputy[c] = chief[c] + relative[0] * axes[0, c] + relative[1] * axes[1, c] + relative[2] * axes[2, c]
        deputy[3 + c] = chief[3 + c] + vx * axes[0, c] + vy * axes[1, c] + vz * axes[2, c]
    return deputy


@inline
def to_relative(axes: Array, rate: float, chief: Array, deputy: Array) -> Array:
    """`relative_from_inertial` for use inside kernels, with the `hill_frame` of the chief."""
    relative = np.empty(6)
    for i in range(3):
        position, velocity = 0.0, 0.0
        for c in range(3):
            position += axes[i, c] * (deputy[c] - chief[c])
            velocity += axes[i, c] * (deputy[3 + c] - chief[3 + c])
        relative[i], relative[3 + i] = position, velocity
    relative[3] += rate * relative[1]
    relative[4] -= rate * relative[0]
    return relative


@kernel((ANY_MATRIX,))
def relative_to_first(states: Array) -> Array:
    """Relative states of all satellites in the Hill frame of the first, as `relative_from_inertial`.

    Args:
        states: inertial, (N, 6), m and m/s; the first is the chief's, and has an orbit plane.

    Returns:
        (N - 1, 6), m and m/s.
    """
    axes, rate = hill_frame(states[0])
    out = np.empty((len(states) - 1, 6))
    for k in range(1, len(states)):
        out[k - 1] = to_relative(axes, rate, states[0], states[k])
    return out
