"""Cache of compiled code: keyed by content, safe for concurrent processes, optional."""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

import formation_gnc
from formation_gnc.orbit import jit

KERNEL = """
from numba import float64
from formation_gnc.orbit.jit import kernel

@kernel(float64(float64))
def twice(x):
    return 2.0 * x

print(twice(21.0), len(twice.stats.cache_hits))
"""


directory = jit._cache_directory


@pytest.fixture
def roots(tmp_path, monkeypatch):
    """Two cache directories: numba's configured one, and the user's."""
    monkeypatch.setattr(jit.numba.config, "CACHE_DIR", str(tmp_path / "configured"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    return tmp_path


def test_cache_lies_where_numba_is_told(roots):
    assert Path(directory("orbit")).parent == roots / "configured"


def reject_all_but_the_users(roots, monkeypatch):
    """Root can write anywhere, so the rejection is simulated."""
    write = tempfile.TemporaryFile

    def reject(dir):
        if Path(dir).is_relative_to(roots / "user"):
            return write(dir=dir)
        raise PermissionError(dir)

    monkeypatch.setattr(jit.tempfile, "TemporaryFile", reject)


def test_cache_of_a_read_only_package_is_the_users(roots, monkeypatch):
    reject_all_but_the_users(roots, monkeypatch)
    assert Path(directory("orbit")).parent == roots / "user" / "formation_gnc"


def test_what_was_compiled_at_the_installation_serves_every_user(roots, monkeypatch):
    """Whoever may read the package but not write to it, as the user of a container, compiles nothing again."""
    installed = Path(directory("orbit"))
    (installed / "orbit_1").mkdir()
    (installed / "orbit_1" / "twice.nbi").write_bytes(b"index")
    reject_all_but_the_users(roots, monkeypatch)
    for _ in range(2):
        own = Path(directory("orbit"))
        assert own.parent == roots / "user" / "formation_gnc"
        assert (own / "orbit_1" / "twice.nbi").read_bytes() == b"index"
        assert [each.name for each in own.parent.iterdir()] == [own.name], "nothing is left half copied"


def test_without_a_writable_directory_there_is_no_cache(roots, monkeypatch):
    def reject(dir):
        raise PermissionError(dir)

    monkeypatch.setattr(jit.tempfile, "TemporaryFile", reject)
    assert directory("orbit") == ""


@pytest.mark.parametrize(
    ("folder", "source"), [(folder, each) for folder in jit.SOURCES for each in jit.SOURCES[folder]]
)
def test_cache_changes_with_any_source(roots, monkeypatch, tmp_path, folder, source):
    """A constant in one file is compiled into kernels of another: neither may outlive the other."""
    file = tmp_path / "package" / source / "constants.py"
    file.parent.mkdir(parents=True)
    file.write_text("MU = 1.0\n")
    monkeypatch.setattr(jit, "_PACKAGE", tmp_path / "package")
    before = directory(folder)
    assert directory(folder) == before
    file.write_text("MU = 2.0\n")
    assert directory(folder) != before


def test_cache_changes_with_the_key_of_what_comes_from_outside(roots):
    assert len({directory("sensors"), directory("sensors", "a star tracker"), directory("sensors", "another")}) == 3


def test_kernels_are_built_from_the_folders_of_their_cache_key():
    package = Path(formation_gnc.__file__).parent
    free_of_kernels = {"formation_gnc.errors", "formation_gnc.parameters", "formation_gnc.types"}
    for file in package.rglob("*.py"):
        imported = set(re.findall(r"^from (formation_gnc\S*) import", file.read_text(), re.MULTILINE))
        if "formation_gnc.orbit.jit" not in imported:
            continue
        folders = [folder for folder in jit.SOURCES if file.is_relative_to(package / folder)]
        assert folders, f"{file} has kernels: add its folder to SOURCES"
        keyed = tuple(f"formation_gnc.{source.replace('/', '.')}" for source in jit.SOURCES[folders[0]])
        assert all(each.startswith(keyed) for each in imported - free_of_kernels), file


@pytest.mark.thorough
def test_concurrent_compilation_is_safe(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(KERNEL)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    run = [sys.executable, str(script)]
    together = [subprocess.Popen(run, env=environment, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    for process in together:
        output, _ = process.communicate(timeout=120)
        assert output.startswith("42.0")
        assert process.returncode == 0
    again = subprocess.run(run, env=environment, capture_output=True, text=True, check=True, timeout=120)
    assert again.stdout == "42.0 1\n"
