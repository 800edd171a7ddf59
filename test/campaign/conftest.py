"""A small campaign: flights of sixty ticks, so that all takes seconds."""

from collections.abc import Callable
from pathlib import Path

import pytest

SMALL = """
scenario: leader_follower
seed: 7
runs: 6
set: {plant.tick: 10.0, plant.duration: 600.0}
dispersions:
  plant.deputy1.relative_state: {hill_normal: {sigma: [3.0, 3.0, 3.0, 0.003, 0.003, 0.003], correlation: {x vy: -0.8}}}
  plant.deputy1.mass: {normal: {mean: 1.0, sigma: 0.02}, within: [0.9, 1.1], as: factor}
faults:
  stuck: {fault: stuck_off, at: {uniform: {low: 0.0, high: 300.0}}, deputy: deputy1, axes: [true, false, false],
          probability: 0.5}
requirements:
  - final_error_m < 100.0 in 60 % at 80 % confidence
  - time to within 50 m < 600 in 60 % at 80 % confidence
  - mean NIS inside its band in 60 % at 80 % confidence
"""
"""A campaign of six flights with dispersions of the start, the mass and a fault."""


@pytest.fixture(scope="session")
def small() -> str:
    return SMALL


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Writes a campaign's file; returns its path."""

    def write(text: str = SMALL, name: str = "small.yaml") -> Path:
        path = tmp_path / name
        path.write_text(text)
        return path

    return write
