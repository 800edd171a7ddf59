"""Run every verification, or the named ones, and write docs/verification/."""

import importlib
import pkgutil
import sys
from pathlib import Path

import verification

OUTPUT = Path("docs/verification")


def main(names: list[str]) -> int:
    """Write the pages of the modules here that have a `main`; 1 when a figure is outside its tolerance."""
    failures = 0
    modules = sorted(module.name for module in pkgutil.iter_modules(verification.__path__))
    for name in names or sorted(modules, key="coverage".__eq__):  # coverage reads the pages of all others
        if name == "__main__":
            continue
        page = getattr(importlib.import_module(f"verification.{name}"), "main", None)
        if page is not None:
            print(f"verifying {name} ...", flush=True)
            failures += page(OUTPUT)
    return int(failures > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
