"""Subcommands of `formation-gnc`, one module each: a docstring for its help, `add_arguments` and `run`."""

from formation_gnc.commands import compare, design, navigate, recover, replay, report, sil, view

COMMANDS = {
    "sil": sil,
    "design": design,
    "navigate": navigate,
    "replay": replay,
    "compare": compare,
    "report": report,
    "view": view,
    "recover": recover,
}
