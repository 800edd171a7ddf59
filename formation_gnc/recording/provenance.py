"""Provenance of a bag: versions and commit, for its metadata."""

import platform
import subprocess
from importlib.metadata import version
from pathlib import Path

import formation_gnc
from formation_gnc.plugins import plugin_versions
from formation_gnc.recording.arithmetic import ARITHMETIC, arithmetic
from formation_gnc.shipped import is_source_tree

LOST = "lost messages"
"""Name of the metadata record with the number of lost messages by topic."""

IGNORED = "messages of other publishers"
"""Name of the metadata record with the number of messages by topic that the recorder left out."""

PACKAGES = ("numpy", "scipy", "numba", "filterpy", "osqp", "clarabel", "mcap")
"""Packages on which the numbers of a run depend."""


def parameters_record(node: str, start: int | None = None) -> str:
    """Name of the metadata record with the parameters of a node.

    Args:
        node: full name.
        start: stamp (ns) of the first answer after a restart; None for the first start.
    """
    return f"parameters {node}" if start is None else f"parameters {node} from {start}"


def provenance() -> dict[str, dict[str, str]]:
    """Metadata records of a bag by name: versions of the software, and what else the last bits depend on."""
    return {
        ARITHMETIC: arithmetic(),
        "versions": {
            "formation_gnc": formation_gnc.__version__,
            "commit": commit(),
            "python": platform.python_version(),
            **{package: version(package) for package in PACKAGES},
            **plugin_versions(),
        },
    }


def commit() -> str:
    """Git commit of the source tree, with `-dirty` when it has changes; `unknown` outside a checkout of its own."""
    if not is_source_tree():
        return "unknown"
    source = Path(formation_gnc.__file__).resolve().parent
    command = ["git", "-C", str(source), "describe", "--always", "--abbrev=40", "--dirty"]
    try:
        return subprocess.run(command, check=True, capture_output=True, text=True, timeout=5.0).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return "unknown"
