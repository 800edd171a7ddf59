"""The wings of the package and its imports, read from the sources without importing them."""

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = "formation_gnc"

FOUNDATION = "foundation"
WINGS = {
    "physics": ("orbit", "relative", "sensors", "plant"),
    "flight": ("flight", "navigation", "guidance", "control", "supervision"),
    "data": ("messages", "recording", "interchange", "analysis"),
    "simulation": ("sil", "campaign", "testing"),
    "shell": ("transport", "nodes", "commands", "cli", "api"),
}
"""Folders and modules of each wing, from the bottom up; all other modules of the root are the foundation."""


@dataclass(frozen=True)
class Import:
    """One import, by full module names: `module` imports `target`.

    deferred: inside a function or for the type checker alone, so that importing `module` does not import `target`.
    """

    module: str
    target: str
    line: int
    deferred: bool


@cache
def modules(root: Path = ROOT) -> dict[str, Path]:
    """File of every module of the package, by full name."""
    found = {}
    for path in sorted((root / PACKAGE).rglob("*.py")):
        parts = path.relative_to(root).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def imports(root: Path = ROOT) -> tuple[Import, ...]:
    """Every import of the package; `from package import name` targets `package.name` where that is a module of ours."""
    known = modules(root)
    return tuple(found for module, path in known.items() for found in _of_module(module, path, frozenset(known)))


def place(module: str) -> str:
    """Folder, or module of the root, that a module of the package belongs to; `formation_gnc` for the root."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else parts[0]


def wing(module: str) -> str:
    """Wing of a module of the package."""
    return next((name for name, places in WINGS.items() if place(module) in places), FOUNDATION)


def _of_module(module: str, path: Path, known: frozenset[str]) -> Iterator[Import]:
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    for node, deferred in _statements(ast.parse(path.read_text(encoding="utf-8")), deferred=False):
        if isinstance(node, ast.Import):
            targets = [alias.name for alias in node.names]
        else:
            base = _absolute(node, package)
            submodules = [f"{base}.{alias.name}" for alias in node.names]
            targets = [name if name in known else base for name in submodules]
        for target in dict.fromkeys(targets):
            yield Import(module, target, node.lineno, deferred)


def _absolute(node: ast.ImportFrom, package: str) -> str:
    if not node.level:
        return node.module or ""
    base = package.split(".")[: len(package.split(".")) - node.level + 1]
    return ".".join([*base, *([node.module] if node.module else [])])


def _statements(tree: ast.AST, deferred: bool) -> Iterator[tuple[ast.Import | ast.ImportFrom, bool]]:
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node, deferred
        else:
            inner = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
            types_only = isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING")
            yield from _statements(node, deferred or inner or types_only)
