"""The page of commands, from their parsers."""

import argparse
from collections.abc import Iterator
from importlib import import_module

from formation_gnc.commands import COMMANDS

HEAD = """\
# Commands

<!-- Written by `python -m tools.write_reference`: change the commands, not this page. -->

Exit status: 0 for success, 1 when a run failed, 2 when an input is not allowed (one line says which), 130 when
interrupted; others are with their command.
"""


def commands_page() -> str:
    """Every command with its options."""
    return HEAD + "".join(map(_section, COMMANDS))


def _section(name: str) -> str:
    command = import_module(f"formation_gnc.commands.{name}")
    parser = argparse.ArgumentParser(add_help=False)
    command.add_arguments(parser)
    rows = "".join(f"| {option} | {meaning} |\n" for option, meaning in _options(parser))
    return f"\n## {name}\n\n{(command.__doc__ or '').strip()}\n\n| option | |\n|---|---|\n{rows}"


def _options(parser: argparse.ArgumentParser) -> Iterator[tuple[str, str]]:
    """Options in the order of their declaration, and what they mean."""
    for action in parser._actions:
        flag = action.option_strings[-1] if action.option_strings else ""
        value = "" if action.nargs == 0 else str(action.metavar or ("" if flag else action.dest))
        words = " ".join(filter(None, (flag, value)))
        yield f"`{words}`", (action.help or "").replace("|", "\\|")
