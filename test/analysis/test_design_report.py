import json

import numpy as np
import pytest

from formation_gnc.analysis.design_report import design, draw
from formation_gnc.control.controller import Vehicle
from formation_gnc.control.controller_manager import ControllerParameters
from formation_gnc.control.models import DESIGN_MODELS
from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.parameters import load

VALUES = {"chief.semi_major_axis": 6978100.0, "chief.inclination": 1.48, "tick": 10.0}


def described(**values):
    return design(load(ControllerParameters, VALUES | {key.replace("__", "."): value for key, value in values.items()}))


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.thorough
def test_every_law_is_reported_and_drawn(algorithm, tmp_path):
    designed = described(algorithm=algorithm, lqr__integral_error=3000.0)
    json.dumps(designed.figures)
    assert draw(designed, tmp_path / "design.png").stat().st_size > 10_000
    assert (len(designed.poles) > 0) == (len(designed.recovery) > 0)
    if len(designed.poles):
        assert designed.poles.real.max() < 0.0
        assert np.abs(designed.recovery[-1, 1:]).max() < 0.1
        assert np.abs(designed.recovery[0, 1:] - 1.0).max() == 0.0


def test_lqr_has_the_guaranteed_margins():
    # Continuous LQR with equal input weights: gain margin 1/2 to infinity or phase margin 60 degrees in all
    # channels at once (Safonov and Athans 1977); slightly reduced by sampling.
    designed = described(algorithm="lqr", tick=1.0)
    assert designed.figures["largest S_I"] < 1.01
    assert designed.figures["phase margin [deg]"] > 59.0
    assert designed.figures["gain margin, down"] < 0.51
    assert designed.figures["gain margin, up"] > 50.0


@pytest.mark.parametrize("changes", [{}, {"lqr__integral_error": 3000.0}, {"algorithm": "hinf"}])
def test_the_loop_stays_stable_up_to_the_gain_margin(changes):
    # Scale the thrust and close the loop.
    parameters = load(ControllerParameters, VALUES | {k.replace("__", "."): v for k, v in changes.items()})
    own = parameters.laws[parameters.algorithm]
    law = ALGORITHMS[parameters.algorithm](own, parameters, Vehicle(100.0, np.full(3, 0.01)))
    margins, controller = design(parameters).figures, law.linear(0)
    phi, gamma = DESIGN_MODELS[own.model](parameters).discretise(0.0, parameters.tick)
    for share in np.linspace(
        margins["gain margin, down"] * 1.01, min(margins["gain margin, up"] or 20.0, 20.0) * 0.99, 12
    ):
        assert np.abs(np.linalg.eigvals(controller.closed_loop(phi, gamma * share))).max() < 1.0


def test_hinf_singular_values_stay_below_their_bounds():
    values = described(algorithm="hinf").singular_values
    for name, bound in {"S": "gamma / w_P", "T": "gamma / w_T", "KS [N/m]": "gamma / w_u [N/m]"}.items():
        assert (values[name].max(axis=1) <= values[bound].min(axis=1)).all()


@pytest.mark.thorough
def test_a_periodic_loop_has_characteristic_exponents():
    # On a circular orbit the exponents are the poles of the time-invariant loop.
    circular = described(algorithm="lqr", lqr__model="tschauner_hempel", lqr__gain="periodic")
    constant = described(algorithm="lqr")
    np.testing.assert_allclose(circular.poles.real, constant.poles.real, rtol=1e-3)
    np.testing.assert_allclose(circular.recovery[:200], constant.recovery[:200], atol=1e-3)
    eccentric = described(
        algorithm="lqr",
        lqr__model="tschauner_hempel",
        lqr__gain="periodic",
        chief__semi_major_axis=1e7,
        chief__eccentricity=0.3,
    )
    assert eccentric.poles.real.max() < 0.0
    assert np.abs(eccentric.recovery[-1, 1:]).max() < 0.1


def test_the_figures_of_mpc_have_the_size_of_the_qp():
    figures = described(algorithm="mpc", mpc__horizon=20, mpc__total_thrust=0.01).figures
    assert figures["variables"] == 60
    assert figures["constraints"] == 60 + 20 * 10
    assert figures["horizon [s]"] == 1200.0
