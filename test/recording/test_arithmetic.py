"""A replay on another processor, or with another BLAS kernel, says so where bits differ."""

import os
import subprocess
import sys

from formation_gnc.recording.arithmetic import arithmetic, difference_of_arithmetic

SHOW = "from formation_gnc.recording.arithmetic import arithmetic; print(arithmetic())"


def in_another_process(**environment: str) -> dict[str, str]:
    inherited = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    shown = subprocess.run(
        [sys.executable, "-c", SHOW], env=inherited | environment, capture_output=True, text=True, check=True
    )
    return dict(eval(shown.stdout))


def test_threads_are_one_unless_the_environment_says_otherwise() -> None:
    assert all("1 thread" in text for name, text in in_another_process().items() if name.startswith("BLAS"))
    two = in_another_process(OPENBLAS_NUM_THREADS="2")
    assert any("2 threads" in text for name, text in two.items() if name.startswith("BLAS"))


def test_another_kernel_is_told_from_this_one_and_the_same_is_not() -> None:
    assert difference_of_arithmetic(arithmetic()) == ""
    other = in_another_process(OPENBLAS_CORETYPE="Nehalem")
    assert any("Nehalem" in text for text in other.values())
    assert "Nehalem" in difference_of_arithmetic(other)
    assert difference_of_arithmetic({}) == ""
