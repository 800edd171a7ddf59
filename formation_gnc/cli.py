"""The `formation-gnc` command."""

import argparse
import io
import os
import signal
import sys
import tempfile
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import NoReturn

from formation_gnc import __version__
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
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    # Import only the command that runs: the libraries of plots and reports take long to load.
    for name in arguments[:1] if set(arguments[:1]) & set(COMMANDS) else COMMANDS:
        command = import_module(f"formation_gnc.commands.{name}")
        doc = (command.__doc__ or "").strip()
        subparser = commands.add_parser(
            name,
            help=doc.splitlines()[0].rstrip("."),
            description=doc,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        command.add_arguments(subparser)
        subparser.set_defaults(run=command.run)
    return parser.parse_args(arguments)


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
