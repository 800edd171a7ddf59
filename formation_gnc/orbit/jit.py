"""Compilation of the hot loops, cached on disk for fast starts of processes.

Numba validates a cached kernel against its own source file only, not against callees and constants of other
files. The cache directory is therefore keyed by the content of every folder that its kernels are built from.
Concurrent processes are safe: numba replaces files atomically, and an explicit signature leaves one entry per
function.
"""

import os
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba

ANY_VECTOR = numba.types.Array(numba.float64, 1, "A", readonly=True)
"""Numba type of a vector argument, contiguous or not, writable or not."""

ANY_MATRIX = numba.types.Array(numba.float64, 2, "A", readonly=True)
"""Numba type of a matrix argument, likewise."""

SOURCES = {
    "orbit": ("orbit",),
    "relative": ("orbit", "relative"),
    "guidance": ("orbit", "guidance"),
    "sensors": ("orbit", "sensors"),
    "navigation/kernels": ("orbit", "sensors", "navigation/kernels"),
    "supervision/kernels": ("orbit", "supervision/kernels"),
}
"""Folders of the package with kernels, and those that kernels in them are built from."""

_PACKAGE = Path(__file__).resolve().parents[1]


def _cache_directory(folder: str, key: str = "") -> str:
    """First writable directory for the compiled kernels of a folder; empty when there is none.

    It begins with what another user, as the one who installed the package, left compiled where this one may not write:
    numba uses no directory that it may only read, and compiling takes minutes.
    """
    digest = sha256(key.encode())
    for source in (source for each in SOURCES[folder] for source in sorted((_PACKAGE / each).rglob("*.py"))):
        digest.update(source.read_bytes())
    name = f"kernels-{digest.hexdigest()[:16]}"
    compiled: Path | None = None
    for root in (numba.config.CACHE_DIR, _PACKAGE / "orbit" / "__pycache__", _user_cache() / "formation_gnc"):
        if not root:
            continue
        directory = Path(root) / name
        try:
            if compiled and not directory.exists():
                _copy(compiled, directory)
            directory.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=directory).close()
        except OSError:
            compiled = compiled or (directory if directory.is_dir() else None)
            continue
        return str(directory)
    return ""


def _copy(compiled: Path, directory: Path) -> None:
    """Copy compiled kernels; whole or not at all, since other processes may do the same at the same time."""
    directory.parent.mkdir(parents=True, exist_ok=True)
    # Not all may be read, or another process was faster.
    with tempfile.TemporaryDirectory(dir=directory.parent) as whole, suppress(OSError):
        shutil.copytree(compiled, Path(whole) / directory.name).rename(directory)


def _user_cache() -> Path:
    """The user's directory for caches; that for temporary files of a user without a home."""
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:
        return Path(tempfile.gettempdir()) / f"cache-{os.getuid()}"


_directory_for = cache(_cache_directory)


def _folder(function: Callable[..., Any]) -> str:
    source = Path(function.__code__.co_filename)
    return next((each for each in SOURCES if source.is_relative_to(_PACKAGE / each)), "orbit")


def kernel[F: Callable[..., Any]](signature: Any, key: str = "") -> Callable[[F], F]:
    """Decorator: compile a function at import, for exactly this signature.

    Without fastmath and threads: the same input gives the same bits. Division by zero follows IEEE 754.

    Args:
        signature: numba signature; arguments of other types or layouts are rejected.
        key: digest of the sources that the function calls outside the folders of `SOURCES`.
    """

    def compile_function(function: F) -> F:
        directory = _directory_for(_folder(function), key)
        previous, numba.config.CACHE_DIR = numba.config.CACHE_DIR, directory
        try:
            compiled: F = numba.njit(signature, cache=bool(directory), error_model="numpy")(function)
        finally:
            numba.config.CACHE_DIR = previous
        return compiled

    return compile_function


def inline[F: Callable[..., Any]](function: F) -> F:
    """Decorator: compile a function for use inside kernels, into which it is always inlined.

    Scalars and tuples as arguments and results stay in registers; arrays do not.
    """
    compiled: F = numba.njit(error_model="numpy", forceinline=True)(function)
    return compiled
