"""Relative models as laws choose them."""

import numpy as np
import pytest

from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.control.controller import Vehicle
from formation_gnc.control.lqr import LinearQuadraticRegulator, LqrParameters
from formation_gnc.control.models import DESIGN_MODELS, PLAN_MODELS, TIME_INVARIANT_MODELS


def test_names_that_scenarios_give_are_offered():
    assert {"hill", "schweighart_sedwick", "j2_gradient", "tschauner_hempel"} <= set(DESIGN_MODELS)
    assert {"hill", "schweighart_sedwick"} <= set(TIME_INVARIANT_MODELS)
    assert {"nonlinear", "oblate"} <= set(PLAN_MODELS)
    assert not set(DESIGN_MODELS) & set(PLAN_MODELS)


@pytest.mark.parametrize("name", DESIGN_MODELS)
@pytest.mark.thorough
def test_a_law_designed_on_any_model_recovers_an_offset_in_it(name: str, vehicle: Vehicle):
    common = CommonParameters(Orbit(7.2e6, 0.01, 1.2, 0.1, 0.2, 0.3), tick=10.0)
    model = DESIGN_MODELS[name](common)
    gain = "discrete" if name in TIME_INVARIANT_MODELS else "periodic"
    law = LinearQuadraticRegulator(LqrParameters(model=name, gain=gain), common, vehicle)
    state = np.array([10.0, -10.0, 10.0, 0.0, 0.0, 0.0])
    for tick in range(600):
        controller = law.linear(round(tick * 1e10))
        phi, gamma = model.discretise(10.0 * tick, 10.0)
        state = phi @ state + gamma @ (controller.d @ state)
    assert np.linalg.norm(state[:3]) < 0.1
