"""Which software flies: what has to be the same on every worker for the same bits."""

from functools import cache
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path

import formation_gnc
from formation_gnc.recording.provenance import PACKAGES, commit


@cache
def software_version() -> str:
    """Version of the project with a digest of its sources and of the packages that its numbers depend on."""
    root = Path(formation_gnc.__file__).resolve().parent
    digest = sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_bytes())
    for package in PACKAGES:
        digest.update(f"{package} {version(package)}".encode())
    return f"{formation_gnc.__version__}+{digest.hexdigest()[:12]}"


@cache
def software_commit() -> str:
    """Git commit of the project."""
    return commit()
