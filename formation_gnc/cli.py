"""The `formation-gnc` command."""

import argparse
import ast
import io
import os
import signal
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import NoReturn

from formation_gnc import __version__, commands
from formation_gnc.commands import COMMANDS
from formation_gnc.errors import ConfigurationError

NAME = "formation-gnc"


class _Parser(argparse.ArgumentParser):
    """Prints errors in one line, as all other errors are."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}; see `{self.prog} --help`\n")


def _prepare_environment() -> None:
    """Replace what a terminal cannot show, and give a user without a home one for the caches of libraries."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        Path.home()
    except RuntimeError:
        import tempfile

        home = Path(tempfile.gettempdir()) / f"formation_gnc-home-{os.getuid()}"
        home.mkdir(mode=0o700, exist_ok=True)
        os.environ["HOME"] = str(home)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a subcommand.

    Returns:
        Exit status: 0 for success, 1 when a run failed, 2 when an input is not allowed, 130 when interrupted.
    """
    _prepare_environment()
    # SIGTERM ends a run as Ctrl-C does: all processes stop and the bag is closed.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    status = _run(sys.argv[1:] if arguments is None else arguments)
    if "rclpy" in sys.modules and Path(sys.argv[0]).name == NAME:  # the process of the command itself
        from formation_gnc.transport.process import leave

        leave(status)
    return status


def _options(arguments: Sequence[str]) -> argparse.Namespace:
    """Options of the command that is asked for, and how it is run."""
    parser = _Parser(
        prog=NAME,
        description="Fly satellites in formation in software-in-the-loop; analyse, compare and replay the runs.",
        epilog="`formation-gnc COMMAND --help` describes each command.",
    )
    parser.add_argument("--version", action="version", version=f"{NAME} {__version__}")
    subparsers = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    # Only the command that runs is imported: what it flies, plots or reads takes seconds to load.
    wanted = arguments[0] if arguments and arguments[0] in COMMANDS else None
    for name in [wanted] if wanted else COMMANDS:
        doc = _documentation(name)
        subparser = subparsers.add_parser(
            name,
            help=doc.splitlines()[0].rstrip("."),
            description=doc,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        if wanted:
            command = import_module(f"formation_gnc.commands.{name}")
            command.add_arguments(subparser)
            subparser.set_defaults(run=command.run)
    return parser.parse_args(arguments)


def _documentation(name: str) -> str:
    """What the module of a command says of it, without importing it."""
    source = Path(commands.__file__).with_name(f"{name}.py").read_text(encoding="utf-8")
    return ast.get_docstring(ast.parse(source)) or ""


def _run(arguments: Sequence[str]) -> int:
    """Run a command, and print what ended it in one line; returns the exit status."""
    try:
        options = _options(arguments)
        return int(options.run(options))
    except ConfigurationError as error:
        print(f"formation-gnc: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except BrokenPipeError:
        return 1
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        print(f"formation-gnc: {place}{' '.join(str(error.strerror or error).split())}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("formation-gnc: interrupted", file=sys.stderr)
        return 130
