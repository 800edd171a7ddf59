"""Forces against potentials, geometry and published rates."""

from math import pi, radians, tau

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import assoc_legendre_p_all, eval_legendre

from formation_gnc.errors import ConfigurationError, ImpactError
from formation_gnc.orbit.constants import EARTH_RADIUS, EARTH_ROTATION_RATE, J2, MU, NORMALISED_ZONALS
from formation_gnc.orbit.elements import Elements, elements_from_state, state_from_elements
from formation_gnc.orbit.forces import drag, harmonics, radiation, third_body, zonal
from formation_gnc.orbit.forces.egm2008 import MAXIMUM_DEGREE, NORMALISED_C, NORMALISED_S
from formation_gnc.orbit.forces.force import Body
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.frames import hill_rotation
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.orbit.sky import ASTRONOMICAL_UNIT, moon, sun

DAY = 86400.0
RADIUS = st.floats(6.5e6, 4.3e7)
SINE = st.one_of(st.floats(-1.0, 1.0), st.sampled_from([-1.0, 0.0, 1.0]))
LONGITUDE = st.floats(0.0, tau)
COMPILES = settings(deadline=None)  # the first call compiles


def point(radius, sine, longitude):
    cosine = np.sqrt(1 - sine**2)
    return radius * np.array([cosine * np.cos(longitude), cosine * np.sin(longitude), sine])


def numerical_gradient(function, position, step=1e3):
    """Six-point central differences: truncation (step / r)^6, rounding 1e-16 / (step / r), so about 1e-12."""
    out = []
    for axis in np.eye(3):
        f = [function(position + k * step * axis) for k in (-3, -2, -1, 1, 2, 3)]
        out.append((-f[0] + 9 * f[1] - 45 * f[2] + 45 * f[3] - 9 * f[4] + f[5]) / (60 * step))
    return np.array(out)


def zonal_potential(degree):
    def potential(position):
        r = np.linalg.norm(position)
        terms = (
            np.sqrt(2 * n + 1) * NORMALISED_ZONALS[n] * (EARTH_RADIUS / r) ** n * eval_legendre(n, position[2] / r)
            for n in range(2, degree + 1)
        )
        return MU / r * sum(terms)

    return potential


@COMPILES
@given(st.integers(2, 6), RADIUS, SINE, LONGITUDE)
@pytest.mark.covers("Neokleous (2.1)-(2.6)", "orbit/forces/zonal.py", differs="(2.6) is (3 sin² λ − 1)/2")
def test_zonal_acceleration_is_the_gradient_of_its_potential(degree, radius, sine, longitude):
    position = point(radius, sine, longitude)
    ours = np.array(zonal.acceleration(degree, *position)) - np.array(zonal.acceleration(0, *position))
    scale = MU / radius**2
    # Differences of two accelerations: rounding of the central term, 1e-16, and of the differentiation.
    assert np.abs(ours - numerical_gradient(zonal_potential(degree), position)).max() < 2e-14 * scale


@pytest.mark.covers("Joshi (3.1)-(3.15)", "orbit/gravity.py")
@pytest.mark.covers(
    "Neokleous (1.1)-(1.3)",
    "orbit/gravity.py",
    differs="in Cartesian coordinates; (1.3) leaves the along-track force out",
)
def test_central_attraction_is_inverse_square():
    position = point(7e6, 0.3, 1.0)
    expected = -MU * position / 7e6**3
    assert np.array(zonal.acceleration(0, *position)) == pytest.approx(expected, rel=1e-15)


@COMPILES
@given(RADIUS, SINE, LONGITUDE)
def test_zonal_recursion_equals_the_closed_form_of_j2(radius, sine, longitude):
    """Degree 2 has its own fast form; with J3 to J6 taken off, the recursion must give the same."""
    position = point(radius, sine, longitude)
    recursion = np.array(zonal.acceleration(3, *position)) - (
        numerical_gradient(lambda p: zonal_potential(3)(p) - zonal_potential(2)(p), position)
    )
    # Rounding of the two accelerations and of the differentiated part, as above.
    assert np.abs(recursion - zonal.acceleration(2, *position)).max() < 2e-14 * MU / radius**2


@COMPILES
@given(st.floats(0.0, pi), st.floats(0.0, tau), st.floats(0.0, 0.3))
@pytest.mark.covers(
    "Neokleous (2.14)-(2.17)", "orbit/forces/zonal.py", differs="(2.15) lacks cos i in z, (2.17) has its signs turned"
)
def test_j2_along_an_orbit_in_hill_components(inclination, anomaly, eccentricity):
    """Joshi (3.46), with i the inclination and u the argument of latitude."""
    state = state_from_elements(Elements(8e6 / (1 - eccentricity), eccentricity, inclination, 0.4, 0.5, anomaly))
    radius, latitude = np.linalg.norm(state[:3]), 0.5 + anomaly
    oblate = np.array(zonal.acceleration(2, *state[:3])) - np.array(zonal.acceleration(0, *state[:3]))
    sine, cosine = np.sin(inclination), np.cos(inclination)
    components = [
        1 - 3 * sine**2 * np.sin(latitude) ** 2,
        2 * sine**2 * np.sin(latitude) * np.cos(latitude),
        2 * sine * cosine * np.sin(latitude),
    ]
    expected = -1.5 * J2 * MU * EARTH_RADIUS**2 / radius**4 * np.array(components)
    # Rounding of the central term, 10 m/s^2.
    assert hill_rotation(state) @ oblate == pytest.approx(expected, abs=1e-14)


def harmonic_potential(degree):
    def potential(position):
        r = np.linalg.norm(position)
        longitude = np.arctan2(position[1], position[0])
        legendre = assoc_legendre_p_all(degree, degree, position[2] / r, norm=True)[0]
        total = 0.0
        for n in range(2, degree + 1):
            for m in range(n + 1):
                # SciPy's have unit norm on [-1, 1] and Condon's sign; geodesy's have mean square 4 pi.
                p = legendre[n, m] * (-1) ** m * np.sqrt(2 * (2 - (m == 0)))
                wave = NORMALISED_C[n, m] * np.cos(m * longitude) + NORMALISED_S[n, m] * np.sin(m * longitude)
                total += (EARTH_RADIUS / r) ** n * p * wave
        return MU / r * total

    return potential


@pytest.mark.parametrize("degree", [2, 4, 20, MAXIMUM_DEGREE])
@pytest.mark.parametrize(
    "place", [(6.6e6, 0.2, 0.5), (7e6, -0.7, 4.0), (6.8e6, 0.999, 2.0), (4.2e7, 0.0, 3.0)], ids=str
)
@pytest.mark.thorough
def test_harmonic_acceleration_is_the_gradient_of_its_potential(degree, place):
    position = point(*place)
    ours = np.array(harmonics.acceleration(degree, 1.0, 0.0, *position)) + MU * position / place[0] ** 3
    expected = numerical_gradient(harmonic_potential(degree), position, step=2e3)
    # Degree 24 varies over r/24: truncation (24 step / r)^6 of its 1e-7 share is 1e-19.
    assert np.abs(ours - expected).max() < 1e-14 * MU / place[0] ** 2


@COMPILES
@given(RADIUS, SINE, LONGITUDE, LONGITUDE)
def test_harmonics_rotate_with_the_earth(radius, sine, longitude, turn):
    fixed = np.array(harmonics.acceleration(8, 1.0, 0.0, *point(radius, sine, longitude)))
    turned = np.array(harmonics.acceleration(8, np.cos(turn), np.sin(turn), *point(radius, sine, longitude + turn)))
    rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    assert turned == pytest.approx(rotation @ fixed, abs=1e-13)


@pytest.mark.thorough
def test_harmonics_are_finite_and_symmetric_at_the_pole():
    pole = np.array(harmonics.acceleration(20, 1.0, 0.0, 0.0, 0.0, 7e6))
    beside = np.array(harmonics.acceleration(20, 1.0, 0.0, 1e-3, 0.0, 7e6))
    assert np.isfinite(pole).all()
    assert pole == pytest.approx(beside, abs=1e-8)


def test_tidal_accelerations_have_their_textbook_size():
    """At GEO, towards the body: 2 mu r / d^3, about 7e-6 m/s^2 for the Moon and 3e-6 for the Sun."""
    for mu, body, size in ((third_body.MU_MOON, moon(0.0), 7.3e-6), (third_body.MU_SUN, sun(0.0), 3.3e-6)):
        distance = np.linalg.norm(body)
        towards = np.array(body) / distance
        tide = np.array(third_body.acceleration(mu, *body, *(42.164e6 * towards)))
        assert tide @ towards == pytest.approx(2 * mu * 42.164e6 / distance**3, rel=0.2)
        assert tide @ towards == pytest.approx(size, rel=0.35)
        across = np.cross(towards, [0.0, 0.0, 1.0])
        across /= np.linalg.norm(across)
        tide = np.array(third_body.acceleration(mu, *body, *(42.164e6 * across)))
        assert tide @ across == pytest.approx(-mu * 42.164e6 / distance**3, rel=0.05)


@pytest.mark.covers("Neokleous (2.7)-(2.10)", "orbit/forces/third_body.py")
def test_third_body_vanishes_at_the_earths_centre():
    assert np.array(third_body.acceleration(third_body.MU_MOON, *moon(0.0), 0.0, 0.0, 0.0)) == pytest.approx(0.0)


def propagated(elements, duration, tick, forces, body=None, epoch=0.0, substeps=1):
    propagator = Propagator(tick, substeps, forces, (body or Body(),), epoch)
    states, thrust = state_from_elements(elements)[None], np.zeros((1, 3))
    for k in range(round(duration / tick)):
        states = propagator.propagate(k * tick, states, thrust)
    return states[0]


@pytest.mark.thorough
def test_sun_and_moon_incline_a_geostationary_orbit_at_the_known_rate():
    """0.75 to 0.95 deg a year, over the Moon's 18.6-year cycle; the yearly mean of 2006 is near the top."""
    start = Elements(42164e3, 0.0, 0.0, 0.0, 0.0, 0.0)
    end = propagated(start, 365 * DAY, 600.0, Forces(sun=True, moon=True), epoch=6 * 365.25 * DAY)
    assert np.degrees(elements_from_state(end).inclination) == pytest.approx(0.90, abs=0.06)
    alone = propagated(start, 365 * DAY, 600.0, Forces(sun=True), epoch=6 * 365.25 * DAY)
    # The Sun's own share is 0.27 deg a year (Soop, Handbook of Geostationary Orbits, section 4.2).
    assert np.degrees(elements_from_state(alone).inclination) == pytest.approx(0.27, abs=0.02)


def test_nodal_drift_of_a_sun_synchronous_orbit():
    """800 km and 98.6 deg give 360 deg a year, for mean elements; these osculate 9 km (0.44 %) below."""
    start = Elements(EARTH_RADIUS + 800e3, 0.0012, radians(98.603), 0.0, pi / 2, 0.0)
    period = start.period
    end = propagated(start, 100 * period, period / 300, Forces(zonal_degree=6))
    drift = elements_from_state(end).right_ascension / (100 * period) * DAY * 365.2422
    assert np.degrees(drift) == pytest.approx(360.0, rel=0.01)


class TestShadow:
    sun = np.array([ASTRONOMICAL_UNIT, 0.0, 0.0])

    def light(self, x, y, z=0.0):
        return radiation.illumination(*self.sun, x, y, z)

    def test_noon_is_sunlit_and_midnight_dark(self):
        assert self.light(7e6, 0.0) == 1.0
        assert self.light(-7e6, 0.0) == 0.0

    def test_umbra_is_a_cone_of_the_right_length(self):
        """R d / (R_sun - R): 1.384 million km behind the Earth; beyond it the eclipse is annular."""
        length = EARTH_RADIUS * ASTRONOMICAL_UNIT / (radiation.SUN_RADIUS - EARTH_RADIUS)
        assert length == pytest.approx(1.384e9, rel=1e-3)
        assert self.light(-length * 0.999, 0.0) == 0.0
        assert 0.0 < self.light(-length * 1.001, 0.0) < 0.02
        assert self.light(-10 * length, 0.0) == pytest.approx(1 - 0.1**2 * 1.19, abs=5e-3)

    @COMPILES
    @given(st.floats(6.5e6, 5e7), st.floats(0.9, 1.1))
    def test_penumbra_is_the_uncovered_area_of_the_disc(self, behind, offset):
        """Counted on a grid over the Sun's disc, seen flat."""
        y = EARTH_RADIUS * offset
        position = np.array([-behind, y, 0.0])
        rays = self.sun - position
        distance = np.linalg.norm(rays)
        sun = np.arcsin(radiation.SUN_RADIUS / distance)
        earth = np.arcsin(EARTH_RADIUS / np.linalg.norm(position))
        apart = np.arccos(-position @ rays / np.linalg.norm(position) / distance)
        u, v = np.meshgrid(np.linspace(-1, 1, 401) * sun, np.linspace(-1, 1, 401) * sun)
        disc = u**2 + v**2 < sun**2
        covered = disc & ((u - apart) ** 2 + v**2 < earth**2)
        # A grid of 401 points resolves an area to its edge, about 1 / 200 of it.
        assert self.light(*position) == pytest.approx(1 - covered.sum() / disc.sum(), abs=6e-3)

    def test_illumination_decreases_monotonically_through_penumbra(self):
        light = [self.light(-7e6, y) for y in np.linspace(EARTH_RADIUS * 1.02, EARTH_RADIUS * 0.98, 2001)]
        assert light[0] == 1.0
        assert light[-1] == 0.0
        assert np.all(np.diff(light) <= 0.0)
        assert np.abs(np.diff(light)).max() < 0.01

    def test_longest_eclipse_at_geostationary_altitude_is_72_minutes(self):
        """At an equinox, counting penumbra in full (Soop, section 4.3: about 72 minutes)."""
        propagator = Propagator(10.0, epoch=(9210 - 0.5) * DAY)  # 20 March 2025
        orbit = Elements(42164e3, 0.0, 0.0, 0.0, 0.0, 0.0)
        period = orbit.period
        angles = np.linspace(0.0, tau, 8640, endpoint=False)
        light = [propagator.illumination(0.0, 42164e3 * np.array([np.cos(a), np.sin(a), 0.0])) for a in angles]
        minutes = np.count_nonzero(np.array(light) < 1.0) / 8640 * period / 60
        assert minutes == pytest.approx(71.5, abs=1.0)


@pytest.mark.covers(
    "Neokleous (2.11)-(2.13)", "orbit/forces/radiation.py", differs="(2.11) is in kW, and C_p lies between 1 and 2"
)
def test_radiation_pressure_is_the_solar_constant_over_c():
    ahead = np.array([ASTRONOMICAL_UNIT, 0.0, 0.0])
    push = np.array(radiation.acceleration(0.02, *ahead, 0.0, 0.0, 7e6))
    assert push[0] == pytest.approx(-0.02 * 1361.0 / 299792458.0, rel=1e-6)
    assert abs(push[1]) == 0.0
    double = np.array(radiation.acceleration(0.02, *(2 * ahead), 0.0, 0.0, 7e6))
    assert push[0] / double[0] == pytest.approx(4.0, rel=1e-6)


@pytest.mark.thorough
def test_density_decreases_without_jumps():
    heights = np.linspace(100e3, 1500e3, 5000)
    air = np.array([drag.density(EARTH_RADIUS + h, 0.0, 0.0) for h in heights])
    assert np.all(np.diff(air) < 0.0)
    # Published bands meet to 3 %: the table rounds scale heights so.
    for base in (150, 200, 300, 350, 400, 450, 500, 600, 700, 800, 900, 1000):
        below = drag.density(EARTH_RADIUS + base * 1e3 - 1.0, 0.0, 0.0)
        assert below == pytest.approx(drag.density(EARTH_RADIUS + base * 1e3 + 1.0, 0.0, 0.0), rel=0.03)
    assert drag.density(EARTH_RADIUS + 747.2119e3, 0.0, 0.0) == pytest.approx(2.1219854e-14, rel=1e-7)  # Vallado 8-4


def test_density_at_equal_radius_is_higher_over_the_equator():
    equator, pole = drag.density(6.778e6, 0.0, 0.0), drag.density(0.0, 0.0, 6.778e6)
    assert equator / pole == pytest.approx(np.exp(21.38e3 / 58.0e3), rel=0.05)


def test_drag_decays_a_circular_orbit_at_the_analytic_rate():
    """da/dt = -rho (C A / m) sqrt(mu a) (1 - w cos(i) / n)^2, over one equatorial orbit."""
    start = Elements(EARTH_RADIUS + 400e3, 0.0, 0.0, 0.0, 0.0, 0.0)
    body = Body(mass=50.0, area=2.0, drag_coefficient=2.2)
    period = start.period
    end = propagated(start, period, period / 500, Forces(zonal_degree=0, drag=True), body)
    change = elements_from_state(end).semi_major_axis - start.semi_major_axis
    rho = 3.725e-12
    wind = (1 - EARTH_ROTATION_RATE / start.mean_motion) ** 2
    expected = -rho * 2.2 * 2.0 / 50.0 * np.sqrt(MU * start.semi_major_axis) * wind * period
    assert change == pytest.approx(expected, rel=5e-3)  # decay of 9 m, with a scale height of 58 km


def test_present_masses_override_those_of_the_bodies():
    start = state_from_elements(Elements(EARTH_RADIUS + 300e3, 0.0, 0.0, 0.0, 0.0, 0.0))[None]
    forces, thrust = Forces(drag=True), np.zeros((1, 3))
    light = Propagator(10.0, 1, forces, (Body(mass=50.0),)).propagate(0.0, start, thrust)
    heavy = Propagator(10.0, 1, forces, (Body(mass=100.0),))
    assert np.array_equal(heavy.propagate(0.0, start, thrust, np.array([50.0])), light)
    assert not np.array_equal(heavy.propagate(0.0, start, thrust), light)


@pytest.mark.parametrize("switch", ["sun", "moon", "radiation_pressure", "drag"])
def test_every_force_acts_and_none_is_on_by_default(switch):
    start = Elements(EARTH_RADIUS + 400e3, 0.0, 0.5, 0.0, 0.0, 0.0)
    plain = propagated(start, 100.0, 10.0, Forces())
    assert not np.array_equal(plain, propagated(start, 100.0, 10.0, Forces(**{switch: True})))


def test_order_of_the_method_holds_with_time_dependent_forces():
    """Moon, Sun and a turning field in one step of 2 s against steps of 60 s and 120 s."""
    forces = Forces(harmonics_degree=8, sun=True, moon=True)
    start = Elements(7.5e6, 0.05, 1.0, 0.0, 0.0, 0.0)
    truth = propagated(start, 4800.0, 10.0, forces, epoch=7e8)
    coarse = np.linalg.norm(propagated(start, 4800.0, 120.0, forces, epoch=7e8) - truth)
    fine = np.linalg.norm(propagated(start, 4800.0, 60.0, forces, epoch=7e8) - truth)
    assert fine > 1e-5
    assert 7.0 < np.log2(coarse / fine) < 10.0


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ({"zonal_degree": 7}, "zonal_degree"),
        ({"harmonics_degree": 25}, "harmonics_degree"),
        ({"sun": 2}, "sun"),
    ],
)
def test_settings_out_of_range_are_rejected(bad, message):
    with pytest.raises(ConfigurationError, match=message):
        Propagator(1.0, forces=Forces(**bad))


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ({"mass": 0.0}, "mass"),
        ({"mass": -1.0}, "mass"),
        ({"area": float("nan")}, "area"),
        ({"reflectivity": 3.0}, "refl"),
    ],
)
def test_bodies_out_of_range_are_rejected(bad, message):
    with pytest.raises(ConfigurationError, match=message):
        Propagator(1.0, bodies=(Body(**bad),))


def test_surface_forces_need_a_body_for_each_satellite():
    with pytest.raises(ConfigurationError, match="bodies is empty"):
        Propagator(1.0, forces=Forces(drag=True))
    with pytest.raises(ConfigurationError, match="2 bodies for 1 satellites"):
        Propagator(1.0, bodies=(Body(), Body())).propagate(0.0, np.ones((1, 6)), np.zeros((1, 3)))


def test_impact_raises_impact_error():
    state = np.array([[EARTH_RADIUS + 1e3, 0.0, 0.0, -500.0, 7000.0, 0.0]])
    with pytest.raises(ImpactError, match="satellite 0 is below the Earth's surface at 10 s"):
        Propagator(10.0).propagate(0.0, state, np.zeros((1, 3)))
    with pytest.raises(ImpactError, match="nan"):
        Propagator(10.0).propagate(0.0, state * np.nan, np.zeros((1, 3)))
