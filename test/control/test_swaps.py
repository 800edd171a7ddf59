"""Swaps of the law in flight, and designs in another thread."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from formation_gnc.control.controller_manager import ControllerManager, ControllerParameters
from formation_gnc.parameters import load
from formation_gnc.records import EventKind
from formation_gnc.relative.hill import HillModel

VALUES = {
    "chief.semi_major_axis": 6978100.0,
    "tick": 10.0,
    **{f"{law}.position_error": (10.0,) * 3 for law in ("lqr", "mpc")},
    **{f"{law}.velocity_error": (0.1,) * 3 for law in ("lqr", "mpc")},
    **{f"{law}.thrust": (0.002,) * 3 for law in ("lqr", "mpc")},
}
ROUND = ("lqr", "hinf", "mpc", "hinf", "lqr") * 2


def simulate(manager, ticks, estimate, target, swaps=()):
    swaps, forces, algorithms = dict(swaps), [], []
    state = np.array([5.0, -8.0, 3.0, 0.0, 0.0, 0.0])
    model = HillModel(load(ControllerParameters, VALUES).mean_motion)
    for tick in range(ticks):
        if tick in swaps:
            manager.commit(manager.stage({"algorithm": swaps[tick]}))
        thrust, status = manager.on_tick(estimate(state, 10.0 * tick), target(time=10.0 * tick))
        assert thrust.time == 10_000_000_000 * tick
        forces.append(thrust.force)
        algorithms.append(status.algorithm)
        state = model.propagate(0.0, state, 10.0, thrust.force / 100.0)
    return np.array(forces), algorithms, state


@pytest.mark.parametrize("form", ["output", "full_information"])
@pytest.mark.parametrize("share", [0.02, 0.1])
def test_swaps_from_lqr_to_hinf_to_mpc_and_back_are_bumpless(form, share, estimate, target):
    manager = ControllerManager("c", load(ControllerParameters, VALUES | {"handover_step": share, "hinf.form": form}))
    swaps = [(60 * index, name) for index, name in enumerate(ROUND)]
    forces, algorithms, state = simulate(manager, 60 * len(ROUND), estimate, target, swaps)
    assert algorithms == [name for name in ROUND for _ in range(60)]
    at = np.array([60 * index for index in range(1, len(ROUND)) if ROUND[index] != ROUND[index - 1]])
    assert (np.abs(forces[at] - forces[at - 1]) <= share * 0.01 * (1.0 + 1e-9)).all()
    assert np.linalg.norm(state[:3]) < 1.0
    events = manager.take_events()
    handovers = [event.tick for event in events if event.kind == EventKind.HANDOVER]
    assert handovers == at.tolist(), "setting the law in force is no change"
    assert not [event for event in events if event.kind == EventKind.FALLBACK]


def test_designs_in_another_thread_are_equal_and_without_effect(estimate, target):
    laws = ["lqr", "hinf", "mpc"]
    quiet = ControllerManager("c", load(ControllerParameters, VALUES))
    expected, _, _ = simulate(quiet, 60, estimate, target)
    manager = ControllerManager("c", load(ControllerParameters, VALUES))
    with ThreadPoolExecutor(2) as pool:
        prepared = [pool.submit(manager.stage, {"algorithm": law}) for law in laws * 3]
        forces, _, _ = simulate(manager, 60, estimate, target)
        designs = [each.result().design for each in prepared]
    np.testing.assert_array_equal(forces, expected)
    here, there = (
        ControllerManager("c", load(ControllerParameters, VALUES)).stage({"algorithm": "hinf"}).design,
        designs[1],
    )
    np.testing.assert_array_equal(here.sampled.a, there.sampled.a)
    np.testing.assert_array_equal(designs[0].gain, designs[3].gain)


@pytest.mark.parametrize("law", ["coast", "lqr", "hinf", "mpc"])
def test_a_flight_is_reproducible_bit_for_bit(law, estimate, target):
    flights = [
        simulate(
            ControllerManager("c", load(ControllerParameters, VALUES | {"algorithm": law})),
            80,
            estimate,
            target,
        )[0]
        for _ in range(2)
    ]
    np.testing.assert_array_equal(flights[0], flights[1])
