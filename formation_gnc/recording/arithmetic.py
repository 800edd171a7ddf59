"""What the last bits of a run's numbers depend on besides the software: processor, and kernel and threads of BLAS."""

import ctypes
import platform
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

ARITHMETIC = "arithmetic"
"""Name of a bag's metadata record with it."""


def arithmetic() -> dict[str, str]:
    """Processor, and kernel and threads of each loaded BLAS library; what cannot be found is left out."""
    np.zeros(1)  # NumPy's is loaded
    found = {"processor": _processor(), "machine": platform.machine()}
    for library in _blas_libraries():
        with suppress(OSError):
            loaded = ctypes.CDLL(str(library))
            kernel = _call(loaded, "get_corename", ctypes.c_char_p)
            threads = _call(loaded, "get_num_threads", ctypes.c_int)
            if kernel is not None:
                found[f"BLAS of {library.parent.name}"] = f"{kernel.decode()}, {threads} thread{'s' * (threads != 1)}"
    return found


def difference_of_arithmetic(recorded: Mapping[str, str]) -> str:
    """How this process differs from a recorded one, in words; empty where it does not, as far as both are known."""
    here = arithmetic()
    words = [
        f"{name}: {recorded[name]} there, {here[name]} here"
        for name in sorted(recorded.keys() & here.keys())
        if recorded[name] != here[name]
    ]
    return "; ".join(words)


def _processor() -> str:
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or "unknown"


def _blas_libraries() -> list[Path]:
    """Files of the OpenBLAS libraries that this process has loaded."""
    with suppress(OSError):
        lines = Path("/proc/self/maps").read_text().splitlines()
        return sorted({Path(line.split(maxsplit=5)[5]) for line in lines if "openblas" in line})
    return []


def _call(library: ctypes.CDLL, function: str, result: type[Any]) -> Any:
    """Result of a function of OpenBLAS by whichever name the build gives it; None without one."""
    for name in _names(function):
        with suppress(AttributeError):
            called = getattr(library, name)
            called.restype = result
            return called()
    return None


def _names(function: str) -> Iterator[str]:
    for prefix in ("openblas", "scipy_openblas"):
        for suffix in ("", "64_", "_64"):
            yield f"{prefix}_{function}{suffix}"
