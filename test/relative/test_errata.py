"""Misprints in the sources: the printed form fails where the corrected one holds.

The table is docs/theory/errata.md. Joshi's state order is [x, x', y, y', z, z']; it is translated here.
"""

import math
from functools import partial

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are
from scipy.optimize import minimize

from formation_gnc.orbit.constants import EARTH_RADIUS, J2, MU
from formation_gnc.orbit.elements import Elements, elements_from_state
from formation_gnc.orbit.frames import hill_rotation, inertial_from_relative
from formation_gnc.orbit.gravity import acceleration as gravity
from formation_gnc.relative.chief import KeplerChief, OblateChief
from formation_gnc.relative.factorisation import oblateness, sdc1
from formation_gnc.relative.hill import HillModel
from formation_gnc.relative.nonlinear import NonlinearModel, jacobian
from formation_gnc.relative.schweighart_sedwick import CircularReference, SchweighartSedwickModel

approx = partial(pytest.approx, abs=0.0)  # most values here are far below the default tolerance of 1e-12

ORBIT = Elements(1.0e7, 0.15, 1.0, 0.3, 0.4, 0.9)
CHIEF = KeplerChief.of(ORBIT)
HERE = CHIEF.at(300.0)
STATE = np.array([4e4, -7e4, 5e4, 30.0, -20.0, 10.0])


def inertial_difference(state, chief, control=(0.0, 0.0, 0.0)):
    """Relative acceleration from Newton's law and the transport theorem alone, in the Hill frame."""
    r, w, a = (
        chief.radius,
        np.array([0.0, 0.0, chief.angular_rate]),
        np.array([0, 0, chief.angular_acceleration]),
    )
    place, velocity = state[:3], state[3:]
    deputy = np.array([r, 0.0, 0.0]) + place
    attraction = -MU * deputy / np.linalg.norm(deputy) ** 3 + np.array([MU / r**2, 0.0, 0.0])
    turning = 2.0 * np.cross(w, velocity) + np.cross(a, place) + np.cross(w, np.cross(w, place))
    return attraction + np.array(control) - turning


@pytest.mark.covers(
    "Joshi (3.17)-(3.26)",
    "relative/nonlinear.py",
    "relative/chief.py",
    differs="(3.21) has the sign of the control wrong, (3.22) the Coriolis term of y",
)
def test_joshi_3_21_control_enters_with_the_other_sign():
    control = np.array([1e-3, 2e-3, -1e-3])
    acceleration = NonlinearModel(CHIEF).derivative(300.0, STATE, control)[3:]
    without = NonlinearModel(CHIEF).derivative(300.0, STATE)[3:]
    # Printed: relative acceleration + ... + (U + a_p) = 0, with the deputy accelerating against its thrust.
    np.testing.assert_allclose(acceleration, inertial_difference(STATE, HERE, control), rtol=1e-11)
    assert np.dot(acceleration - without, control) > 0.0


def test_joshi_3_22_coriolis_term_of_y_is_in_x_rate():
    x, y, _, vx, _, _ = STATE
    w, a = HERE.angular_rate, HERE.angular_acceleration
    rest = -a * x + w**2 * y - MU * y / np.linalg.norm(STATE[:3] + np.array([HERE.radius, 0, 0])) ** 3
    truth = inertial_difference(STATE, HERE)[1]
    assert -2 * w * vx + rest == approx(truth, rel=1e-12)
    assert -2 * w * x + rest != approx(truth, rel=1.0)  # printed: -2 nu' x, a thousand times too large


def differential_oblateness(elements, relative):
    """J2 acceleration of deputy less chief in the chief's Hill frame; and both inertial states."""
    chief = OblateChief(elements).inertial(0.0)
    deputy = inertial_from_relative(chief, relative)

    def oblate(state):
        return gravity(state[:3]) + MU * state[:3] / np.linalg.norm(state[:3]) ** 3

    return hill_rotation(chief) @ (oblate(deputy) - oblate(chief)), chief, deputy


def printed_components(state, doubled):
    """Joshi's J (after 3.48) in the satellite's own axes, over r^4; `doubled` has the factors of (3.46)."""
    orbit = elements_from_state(state)
    i, u = orbit.inclination, orbit.argument_of_perigee + orbit.true_anomaly
    factor = 2.0 if doubled else 1.0
    j = [
        1.0 - 3.0 * (math.sin(i) * math.sin(u)) ** 2,
        factor * math.sin(i) ** 2 * math.sin(u) * math.cos(u),
        factor * math.sin(i) * math.cos(i) * math.sin(u),
    ]
    return np.array(j) / np.linalg.norm(state[:3]) ** 4


@pytest.mark.covers(
    "Joshi (3.38)-(3.48)",
    "relative/oblate.py",
    differs="(3.39)-(3.44) have misprinted denominators, (3.48) the wrong sign, and J_y, J_z half of what (3.46) has",
)
def test_joshi_3_48_sign_and_the_factor_two():
    # Where the sign and the factors matter alone: the acceleration of one satellite in its own axes (3.46).
    _, chief, _ = differential_oblateness(ORBIT, STATE)
    truth = hill_rotation(chief) @ (gravity(chief[:3]) + MU * chief[:3] / np.linalg.norm(chief[:3]) ** 3)
    strength = 1.5 * MU * EARTH_RADIUS**2 * J2
    np.testing.assert_allclose(-strength * printed_components(chief, doubled=True), truth, rtol=1e-8, atol=1e-12)
    assert not np.allclose(-strength * printed_components(chief, doubled=False), truth, rtol=0.1, atol=1e-12)


def test_joshi_3_48_neglects_the_rotation_between_the_two_axes():
    # Even with sign and factors right, each J belongs to its own satellite's axes, which differ by rho / r:
    # a part of the difference as large as the difference itself, and no smaller for a deputy that is near.
    for size in (1.0, 1e-2):
        truth, chief, deputy = differential_oblateness(ORBIT, size * STATE)
        strength = 1.5 * MU * EARTH_RADIUS**2 * J2
        ours = -strength * (printed_components(deputy, True) - printed_components(chief, True))
        assert np.linalg.norm(ours - truth) > 0.2 * np.linalg.norm(truth)
        turn = hill_rotation(chief) @ hill_rotation(deputy).T
        turned = -strength * (turn @ printed_components(deputy, True) - printed_components(chief, True))
        np.testing.assert_allclose(turned, truth, atol=1e-6 * np.linalg.norm(truth))
    exact = oblateness(STATE, OblateChief(ORBIT).at(0.0)) @ STATE[:3]
    np.testing.assert_allclose(exact, differential_oblateness(ORBIT, STATE)[0], rtol=1e-9)


@pytest.mark.covers("Joshi (4.14)-(4.19)", "guidance/relative_orbit.py", differs="(4.17) lacks ω")
def test_joshi_4_17_lacks_the_rate():
    rho, theta, w, m, n, a, b = 1e3, 0.7, 1e-3, 1.0, 0.5, 0.0, 20.0

    def formation(t):
        p = w * t + theta
        return np.array(
            [
                rho * math.sin(p) + a,
                2 * rho * math.cos(p) - 1.5 * w * a * t + b,
                m * rho * math.sin(p) + 2 * n * rho * math.cos(p),
            ]
        )

    t = 123.0
    rate = (formation(t + 1.0) - formation(t - 1.0)) / 2.0
    p = w * t + theta
    assert rate[0] == approx(rho * w * math.cos(p), rel=1e-6)  # printed: rho cos(p)
    assert rate[1] == approx(-2 * rho * w * math.sin(p) - 1.5 * w * a, rel=1e-6)  # (4.18) is right
    assert rate[2] == approx(m * rho * w * math.cos(p) - 2 * n * rho * w * math.sin(p), rel=1e-6)
    # With omega in (4.17) the formation is a free motion of Hill's equations.
    start, later = (np.concatenate((formation(s), (formation(s + 0.1) - formation(s - 0.1)) / 0.2)) for s in (0, 900.0))
    np.testing.assert_allclose(HillModel(w).propagate(0.0, start, 900.0)[:3], later[:3], atol=1e-4)


@pytest.mark.covers(
    "Joshi (5.17)-(5.27)", "relative/factorisation.py", differs="A21, A23, A25 and A66 of (5.26) are misprinted"
)
def test_joshi_5_26_entries_of_the_factorisation():
    x, y, z = STATE[:3]
    r, w, a = HERE.radius, HERE.angular_rate, HERE.angular_acceleration
    d = np.linalg.norm([r + x, y, z])
    xi = -2 * x / r - (x**2 + y**2 + z**2) / r**2
    psi = 2.0 / 3.0 * ((1 - xi) ** -1.5 - 1) / xi  # (5.24), (5.25) summed
    corrected = [
        w**2 - MU / d**3 + 1.5 * MU / r**3 * psi * (2 + x / r),
        a + 1.5 * MU / r**4 * psi * y,
        1.5 * MU / r**4 * psi * z,
    ]
    printed = [
        w**2 - MU / d**3 + 1.5 * MU / r**2 * psi * (2 + x / r),
        a + 1.5 * MU / r**2 * psi * y,
        1.5 * MU / r**2 * psi * z,
    ]
    ours = sdc1(STATE, HERE)
    np.testing.assert_allclose(ours[3, :3], corrected, rtol=1e-10)
    truth = inertial_difference(STATE, HERE)[0]
    assert np.dot(corrected, STATE[:3]) + 2 * w * STATE[4] == approx(truth, rel=1e-10)
    assert abs(np.dot(printed, STATE[:3]) + 2 * w * STATE[4] - truth) > 1e3 * abs(truth)
    assert ours[5, 5] == 0.0  # printed: 1 in A66, a deputy whose cross-track rate grows e-fold each second


def test_joshi_5_37_expansion_of_the_fourth_power():
    x, y, z = STATE[:3]
    r = HERE.radius
    d = np.linalg.norm([r + x, y, z])
    square = (x**2 + y**2 + z**2) / r**2
    assert (1 - (-2 * x / r - square)) ** -2 / r**4 == approx(d**-4, rel=1e-12)
    assert (1 - (2 * x / r - square)) ** -2 / r**4 != approx(d**-4, rel=1e-3)
    # (5.39): eta_2 and eta_3 continue eta, not psi.
    xi = -2 * x / r - square
    eta, psi = [1.5 * xi], [1.25 * xi]
    for k in range(2, 9):
        eta.append((k + 2) / (k + 1) * eta[-1] * xi)
        psi.append((k + 1.5) / (k + 1) * psi[-1] * xi)
    mixed = [1.5 * xi, 4 / 3 * psi[0] * xi, 5 / 4 * psi[1] * xi]
    exact = ((1 - xi) ** -2 - 1) / (2 * xi)
    assert 1 + sum(eta) == approx(exact, rel=1e-12)
    assert abs(1 + sum(mixed) - exact) > 5 * abs(1 + sum(eta[:3]) - exact)


@pytest.mark.parametrize("angle", [2.0, 3.0, 5.0])
@pytest.mark.covers(
    "Joshi (5.34)-(5.55)",
    "relative/factorisation.py",
    differs="an exact factorisation in place of series that fail beyond 2 rad, and signs",
)
def test_joshi_5_45_truncated_series_fails_beyond_two_radians(angle):
    series = angle - angle**3 / 6 + angle**5 / 120
    assert abs(series - math.sin(angle)) > 0.02  # of a sine of one, at arguments of latitude up to 2 pi


def sine_factors(value, change):
    """alpha with sin v = v alpha, beta with sin(v + dv) = (v + dv)(alpha + beta): (5.49)-(5.52), summed."""
    alpha = math.sin(value) / value
    return alpha, math.sin(value + change) / (value + change) - alpha


def test_joshi_5_52_eta_has_a_minus():
    i, d = 0.4, 0.05
    beta = -((i + d) ** 2 - i**2) / 6 + ((i + d) ** 4 - i**4) / 120
    quartic = (4 * i**3 + 6 * d * i**2 + 4 * d**2 * i + d**3) / 120
    assert (-(2 * i + d) / 6 + quartic) * d == approx(beta, rel=1e-12)
    assert ((2 * i + d) / 6 + quartic) * d != approx(beta, rel=1.0)


def test_joshi_5_53_zetas():
    i, u, di, du = 0.9, 0.7, 0.03, -0.04
    (ai, bi), (au, bu) = sine_factors(i, di), sine_factors(u, du)
    (a2i, b2i), (a2u, b2u) = sine_factors(2 * i, 2 * di), sine_factors(2 * u, 2 * du)
    ni, nu, n2i, n2u = bi / di, bu / du, b2i / (2 * di), b2u / (2 * du)
    x = [
        (ai + bi) ** 2 * (u + du) ** 2 * (au + bu) ** 2 * (2 * i + di),
        i**2 * (ai + bi) ** 2 * (au + bu) ** 2 * (2 * u + du),
        i**2 * u**2 * (au + bu) ** 2 * (2 * ai + bi) * ni,
        i**2 * u**2 * ai**2 * (2 * au + bu) * nu,
    ]
    sin2 = math.sin(i + di) ** 2 * math.sin(u + du) ** 2 - math.sin(i) ** 2 * math.sin(u) ** 2
    assert (x[0] + x[2]) * di + (x[1] + x[3]) * du == approx(sin2, rel=1e-10)  # x is right

    def y(power):
        return [
            2 * (ai + bi) ** 2 * (u + du) * (a2u + b2u) * (2 * i + di),
            2 * i**2 * (u + du) * (a2u + b2u) * (2 * ai + bi) ** power * ni,
            2 * i**2 * ai**2 * (a2u + b2u),
            4 * i**2 * ai**2 * u * n2u,
        ]

    truth = math.sin(i + di) ** 2 * math.sin(2 * (u + du)) - math.sin(i) ** 2 * math.sin(2 * u)
    one, two = y(1), y(2)
    assert (one[0] + one[1]) * di + (one[2] + one[3]) * du == approx(truth, rel=1e-10)
    assert (two[0] + two[2]) * di + (two[1] + two[3]) * du != approx(truth, rel=0.1)  # printed
    assert (one[0] + one[2]) * di + (one[1] + one[3]) * du != approx(truth, rel=0.1)  # the pairs alone
    assert (two[0] + two[1]) * di + (two[2] + two[3]) * du != approx(truth, rel=0.01)  # the square alone

    def z(power):
        return [
            2 * (a2i + b2i) ** power * (u + du) * (au + bu),
            4 * i * (u + du) * (au + bu) * n2i,
            2 * i * a2i * (au + bu),
            2 * i * a2i * u * nu,
        ]

    truth = math.sin(2 * (i + di)) * math.sin(u + du) - math.sin(2 * i) * math.sin(u)
    one, two = z(1), z(2)
    assert (one[0] + one[1]) * di + (one[2] + one[3]) * du == approx(truth, rel=1e-10)
    assert (two[0] + two[2]) * di + (two[1] + two[3]) * du != approx(truth, rel=0.1)  # printed


@pytest.mark.covers(
    "Joshi (6.28)-(6.40)",
    "relative/nonlinear.py",
    differs="powers of γ for powers of d, and signs in (6.33), (6.35), (6.36), (6.40)",
)
def test_joshi_6_28_to_6_40_jacobian():
    x, y, z = STATE[:3]
    r, w, a = HERE.radius, HERE.angular_rate, HERE.angular_acceleration
    d = np.linalg.norm([r + x, y, z])
    exact = jacobian(STATE, HERE)
    corrected = {
        (3, 0): w**2 - MU * (d**3 - 3 * x * d * (r + x)) / d**6 + 3 * MU * r * (r + x) / d**5,  # (6.28)
        (3, 1): a + 3 * MU * y * (r + x) / d**5,  # (6.29)
        (3, 2): 3 * MU * (r + x) * z / d**5,  # (6.31)
        (4, 0): -a + 3 * MU * y * (r + x) / d**5,  # (6.33)
        (4, 1): w**2 - MU * (d**3 - 3 * y**2 * d) / d**6,  # (6.35)
        (4, 2): 3 * MU * y * z / d**5,  # (6.36)
        (5, 0): 3 * MU * z * (r + x) / d**5,  # (6.38)
        (5, 1): 3 * MU * y * z / d**5,  # (6.39)
        (5, 2): -MU * (d**3 - 3 * z**2 * d) / d**6,  # (6.40)
    }
    for place, value in corrected.items():
        assert value == approx(exact[place], rel=1e-10)
    printed = {  # signs, rates and powers of the state as printed; powers of gamma read as powers of d
        (4, 0): -w - 3 * MU * y * (r + x) / d**5,
        (4, 1): w**2 + MU * (d**3 - 3 * y**2 * d) / d**6,
        (4, 2): -3 * MU * y * z / d**5,
        (5, 2): -MU * (d**3 - 3 * z * d) / d**6,
    }
    for place, value in printed.items():
        assert value != approx(exact[place], rel=1e-6)
    # gamma is d^3 by (3.24) ff., so that gamma^(-5/2), as printed, is d^(-7.5): not even the unit is right.
    gamma = d**3
    assert a + 3 * MU * gamma**-2.5 * y * (r + x) != approx(exact[3, 1], rel=1e-2)


@pytest.mark.covers("Joshi (6.41)-(6.46)", "relative/oblate.py", differs="the derivative of d⁻⁴ and the sign of (3.54)")
def test_joshi_6_41_derivative_of_the_fourth_power():
    r, (x, y, z) = HERE.radius, STATE[:3]

    def inverse_fourth(dx):
        return ((r + x + dx) ** 2 + y**2 + z**2) ** -2

    d, rho = np.linalg.norm([r + x, y, z]), np.linalg.norm(STATE[:3])
    slope = (inverse_fourth(10.0) - inverse_fourth(-10.0)) / 20.0
    assert -4 * (r + x) / d**6 == approx(slope, rel=1e-8)
    assert 4 * x / (d**5 * math.sqrt(rho)) != approx(slope, rel=0.5)


def test_joshi_table_8_2_perigee_is_inside_the_earth():
    assert EARTH_RADIUS > 11114.5e3 * (1.0 - 0.5)
    assert KeplerChief(11114.5e3, 0.5).at(0.0).radius < EARTH_RADIUS  # accepted all the same


@pytest.mark.covers("Roberts (37)", "relative/j2_gradient.py", differs="the Coriolis term has ω' for ω")
def test_roberts_37_coriolis_term_is_in_the_rate():
    # The reference turns at a constant rate, so that the printed term would vanish and with it the coupling
    # of x and y by which (24) has 2 n c.
    model = SchweighartSedwickModel(CircularReference(7e6, 1.0))
    assert model.dynamics()[3, 4] == approx(2.0 * model.reference.rate)


@pytest.mark.covers(
    "Kremmydas 1.1.4, Tschauner-Hempel",
    "relative/tschauner_hempel.py",
    differs="terms are lost in x, z and the rate's rate",
)
def test_kremmydas_tschauner_hempel_equations():
    # ESA axes: x along-track, y against the normal, z to Earth.
    turn = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    exact = jacobian(np.zeros(6), HERE)
    gradient, gyration = turn @ exact[3:, :3] @ turn.T, turn @ exact[3:, 3:] @ turn.T
    r, w, a = HERE.radius, HERE.angular_rate, HERE.angular_acceleration
    k = MU / r**3
    np.testing.assert_allclose(gradient, [[w**2 - k, 0, a], [0, -k, 0], [-a, 0, w**2 + 2 * k]], atol=1e-20)
    np.testing.assert_allclose(gyration, [[0, 0, 2 * w], [0, 0, 0], [-2 * w, 0, 0]], atol=1e-20)
    # Printed x: -k x + 2 w z' - 2 w x', a damping; the terms in w' are missing in x and z, w^2 x in x.
    assert gyration[0, 0] == 0.0
    e, n, nu = CHIEF.eccentricity, CHIEF.mean_motion, CHIEF.anomaly(300.0)
    corrected = -2 * n**2 * e * math.sin(nu) * (1 + e * math.cos(nu)) ** 3 / (1 - e**2) ** 3
    assert corrected == approx(a, rel=1e-12)
    assert -2 * n**2 * e * math.sin(nu + e * math.cos(nu)) ** 3 / (1 - e**2) ** 3 != approx(a, rel=0.1)


@pytest.mark.covers(
    "Kremmydas 1.1.3, matrices; 4.1",
    "relative/hill.py",
    differs="the printed matrices are those of 1.0618e-3 rad/s, not of the rates beside them (0.0011 and 1.127e-6)",
)
def test_kremmydas_rate_behind_the_printed_matrices():
    printed = {
        (0, 2): 0.03,
        (0, 3): 279.81,
        (0, 5): 94.76,
        (1, 1): 0.95,
        (2, 2): 1.15,
        (3, 3): 0.80,
        (3, 5): 0.63,
    }
    turn = np.zeros((6, 6))
    turn[:3, :3] = turn[3:, 3:] = [[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]]
    at_700_km = math.sqrt(MU / (EARTH_RADIUS + 700e3) ** 3)
    assert at_700_km == approx(1.0600e-3, rel=2e-3)
    # The printed entries give 1.0618e-3 rad/s: neither the 0.0011 of the text nor its 1.127e-6.
    matrix = turn @ HillModel(1.0618e-3).transition(0.0, 300.0) @ turn.T
    for place, value in printed.items():
        assert matrix[place] == approx(value, abs=0.0051)
    other = turn @ HillModel(1.1e-3).transition(0.0, 300.0) @ turn.T
    assert abs(other[0, 3] - 279.81) > 1.0
    gamma = turn @ HillModel(1.0618e-3).discretise(0.0, 300.0)[1] @ turn[:3, :3].T
    np.testing.assert_allclose(np.diag(gamma), [43483.09, 44620.77, 44620.77], rtol=1e-4)
    assert gamma[0, 2] == approx(9507.94, rel=1e-4)


def lvlh(state):
    """Hill state of an ESA LVLH state."""
    x, y, z, vx, vy, vz = state
    return np.array([-z, x, -y, -vz, vx, -vy])


@pytest.mark.parametrize(("sign", "offset"), [(-1.0, 0.0), (1.0, 2000.0)])
def test_kremmydas_4_3_radial_rate_centres_the_ellipse_with_a_minus(sign, offset):
    model, x0 = HillModel(1.06e-3), 1000.0
    w = model.mean_motion
    start = lvlh([x0, 0.0, 0.0, 0.0, x0 * math.sqrt(0.75) * w, sign * 0.5 * x0 * w])
    path = model.propagate(0.0, start, np.arange(64) * model.period / 64)
    assert path[:, 1].mean() == pytest.approx(offset, abs=1e-6)


@pytest.mark.parametrize(("first", "second", "constant"), [(-1.0, 1.0 / 3.0, True), (1.0, 1.0, False)])
def test_kremmydas_4_4_tetrahedron_volume_needs_the_codes_signs(first, second, constant):
    model, a = HillModel(1.06e-3), 129.9
    w, root = model.mean_motion, math.sqrt(3.0)
    one = [
        -2 / 3 * a,
        first * root * a,
        2 * math.sqrt(2) / 3 * a,
        4 * math.sqrt(2) / 3 * w * a,
        0.0,
        w * a / 3,
    ]
    two = [2 * a, second * root * a, 0.0, 0.0, 2 * math.sqrt(2) / root * w * a, -w * a]
    times = np.arange(40) * model.period / 40
    paths = [model.propagate(0.0, lvlh(start), times)[:, :3] for start in (one, two)]
    stations = [np.array([0.0, along, 0.0]) for along in (-500.0, 500.0)]
    volumes = [
        abs(np.linalg.det(np.array([stations[1] - stations[0], p - stations[0], q - stations[0]]))) / 6.0
        for p, q in zip(*paths, strict=True)
    ]
    assert bool(np.ptp(volumes) < 1e-9 * max(volumes)) == constant


@pytest.mark.covers(
    "Neokleous (1.4)-(1.6)",
    "relative/nonlinear.py",
    differs="(1.4) has the sign of ρ wrong, (1.6) the power on the numerator too, and the numerator of z",
)
def test_neokleous_1_6_power_and_numerator():
    r, (x, y, z) = HERE.radius, STATE[:3]
    d2 = (r + x) ** 2 + y**2 + z**2
    truth = inertial_difference(np.concatenate((STATE[:3], np.zeros(3))), HERE)
    assert -MU * z / d2**1.5 == approx(truth[2], rel=1e-12)
    assert -((MU * (r + x) / d2) ** 1.5) != approx(truth[2], rel=1.0)


def test_neokleous_1_4_separation_is_the_satellite_less_the_point():
    # rho = r1 - r2 as printed would have the acceleration of -rho: the sign shows along the radius.
    ahead = np.array([100.0, 0, 0, 0, 0, 0])
    tidal = MU * (1 / HERE.radius**2 - 1 / (HERE.radius + 100.0) ** 2)
    moving = inertial_difference(ahead, HERE)[0] - HERE.angular_rate**2 * 100.0
    assert tidal == approx(moving, rel=1e-8)  # mu [r1/r1^3 - r2/r2^3] is that of r2 - r1
    assert tidal > 0.0


@pytest.mark.covers("Neokleous (1.7)-(1.11)", "relative/tschauner_hempel.py")
def test_neokleous_1_11_is_correct():
    r, w, a = HERE.radius, HERE.angular_rate, HERE.angular_acceleration
    k = MU / r**3
    printed = [[2 * k + w**2, a, 0], [-a, w**2 - k, 0], [0, 0, -k]]
    np.testing.assert_allclose(jacobian(np.zeros(6), HERE)[3:, :3], printed, rtol=1e-12, atol=1e-22)


@pytest.mark.covers(
    "Neokleous (2.18)", "relative/schweighart_sedwick.py", differs="c has no μ, and stands in the second row too"
)
def test_neokleous_2_18_c_is_without_mu_and_in_both_rows():
    reference = CircularReference(42164e3, 0.0)
    c2 = 1 + 3 * J2 * EARTH_RADIUS**2 / (8 * reference.radius**2) * (1 + 3 * math.cos(2 * reference.inclination))
    assert math.sqrt(c2) * reference.mean_motion == approx(reference.rate, rel=1e-12)
    assert 3 * J2 * MU * EARTH_RADIUS**2 / (8 * reference.radius**2) > 1e9  # with mu: not even a number
    # Coriolis terms do no work: the velocity block of A must be skew, which 2nc above and -2n below is not.
    block = SchweighartSedwickModel(reference).dynamics()[3:, 3:]
    np.testing.assert_array_equal(block, -block.T)


def test_neokleous_3_13_second_measurement_is_the_firsts_derivative():
    n, state = 7.29e-5, np.array([100.0, 300.0, -50.0, 0.01, 0.02, 0.03])
    r1 = 42164e3

    def square(s):
        return (r1 + s[0]) ** 2 + s[1] ** 2 + s[2] ** 2

    ahead, behind = (HillModel(n).propagate(0.0, state, t) for t in (0.5, -0.5))
    rate = 0.5 * (square(ahead) - square(behind))
    x, y, z, vx, vy, vz = state
    assert (r1 + x) * vx + y * vy + z * vz == approx(rate, rel=1e-5)
    assert 0.5 * square(state) != approx(rate, rel=1e3)  # printed: (1/2) r2^2


@pytest.mark.covers(
    "Neokleous (3.14)-(3.19); (3.20)-(3.23)",
    "navigation/process.py",
    differs="(3.20) has a stray T and lacks c, (3.21) is 6 × 3 with T; ours is discretised exactly",
)
def test_neokleous_3_20_matrix_is_the_euler_step():
    model = SchweighartSedwickModel(CircularReference(42164e3, 0.0))
    order = [0, 3, 1, 4, 2, 5]  # x, x', y, y', z, z'
    euler = np.eye(6) + 6.0 * model.dynamics()[np.ix_(order, order)]
    assert euler[3, 4] == 0.0  # printed: T
    assert euler[3, 1] == approx(-2 * 6.0 * model.reference.rate)  # printed: -2 T n
    inputs = 6.0 * model.INPUT[order]
    assert inputs.shape == (6, 3)  # printed (3.21): one column, without T
    assert inputs[1, 0] == inputs[3, 1] == inputs[5, 2] == 6.0


@pytest.mark.covers(
    "Owis (3.6)-(3.8); (3.1)-(3.5)", differs="(3.7) is no factorisation of (3.2) as printed: A43 = −2 x4/x1"
)
def test_owis_3_7_factorisation():
    r, theta, rate_r, rate = 1.1, 0.8, 0.05, 0.9
    state = np.array([r, theta, rate_r, rate])
    truth = np.array([rate_r, rate, r * rate**2 - 1 / r**2, -2 * rate_r * rate / r])
    corrected = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [rate**2, -1 / (r**2 * theta), 0, 0], [0, 0, -2 * rate / r, 0]])
    np.testing.assert_allclose(corrected @ state, truth, rtol=1e-12)
    printed = corrected.copy()
    printed[3] = [-2 * rate / r**2, 0, 0, 0]
    assert abs((printed @ state - truth)[3]) > 10 * abs(truth[3])


@pytest.mark.covers("Owis 4, first transfer", differs="the final rate of r = 1.2 is 0.7607, not 0.54433")
def test_owis_final_rate_belongs_to_another_radius():
    assert approx(0.7607, abs=1e-4) == 1.2**-1.5
    assert approx(0.54433105395, abs=1e-11) == 1.5**-1.5  # printed for r = 1.2


@pytest.mark.covers(
    "Joshi (8.6)-(8.8)", "control/networks.py", differs="(8.8) is no solution of (8.6) by its dimensions"
)
def test_joshi_8_8_weights_minimise_the_cost_of_8_6():
    rng = np.random.default_rng(3)
    phi, target, before, r1 = rng.normal(size=4), 0.7, rng.normal(size=4), 0.3

    def cost(w):
        return 0.5 * (target - w @ phi) ** 2 + 0.5 * r1 * (w - before) @ (w - before)

    best = minimize(cost, before, tol=1e-14).x
    corrected = np.linalg.solve(np.outer(phi, phi) + r1 * np.eye(4), phi * target + r1 * before)
    np.testing.assert_allclose(corrected, best, atol=1e-6)
    # Printed: divided by phi' phi + R1 I, a matrix only if phi phi' is meant.
    printed = (phi * target + r1 * before) / (phi @ phi + r1)
    assert not np.allclose(printed, best, atol=0.05)


@pytest.mark.covers(
    "Joshi (5.8)-(5.16)",
    "control/sdre_finite.py",
    "control/fixed_endpoint_lq.py",
    differs="(5.11), (5.12) have Q for −Q, and the transition matrix from t₀ where that to go is needed",
)
def test_joshi_5_11_lower_left_block_is_minus_q():
    # Along the Hamiltonian flow the costate must be the gradient of the cost: lambda = P x of the Riccati
    # equation is an invariant subspace of H with -Q, and not with +Q.
    n = 1.0
    a, b = HillModel(n).dynamics(), HillModel.INPUT
    q, r = np.eye(6), 2.0 * np.eye(3)
    p = solve_continuous_are(a, b, q, r)
    g = b @ np.linalg.solve(r, b.T)
    closed = a - g @ p
    for sign, holds in ((-1.0, True), (1.0, False)):
        residual = sign * q - a.T @ p - p @ closed
        assert bool(np.abs(residual).max() < 1e-9) == holds
