"""What the page's figures hold of the curves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formation_gnc.analysis.plot import Axis, Curve, Plot, Style
from formation_gnc.analysis.plotly_renderer import draw_columns
from formation_gnc.analysis.timeline import Timeline
from formation_gnc.types import Vector


def drawn(x: Vector) -> dict[str, object]:
    curve = Curve("error", x, np.arange(len(x), dtype=float), Style("black"))
    figure = draw_columns([[Plot("", Axis("time [h]"), Axis("error [m]"), [curve])]], Timeline((), (), {}))
    trace: dict[str, object] = dict(figure.data[0].to_plotly_json(), x=figure.data[0].x)
    return trace


@given(st.floats(0.0, 1e5), st.floats(1e-3, 1e3), st.integers(3, 4000))
def test_equal_steps_are_begin_and_step_and_no_pixel_moves(begin: float, step: float, count: int) -> None:
    x = begin + step * np.arange(count)
    trace = drawn(x)
    assert trace["x"] is None
    again = trace["x0"] + trace["dx"] * np.arange(count)  # type: ignore[operator]
    np.testing.assert_allclose(again, x, rtol=0.0, atol=1e-4 * (x[-1] - x[0]))  # a screen has 4000 pixels


@pytest.mark.parametrize(
    "x", [np.array([0.0]), np.array([0.0, 1.0]), np.array([0.0, 1.0, 3.0]), np.array([3.0, 2.0, 1.0]), np.zeros(3)]
)
def test_other_places_are_kept(x: Vector) -> None:
    trace = drawn(x)
    np.testing.assert_array_equal(np.asarray(trace["x"]), x)
