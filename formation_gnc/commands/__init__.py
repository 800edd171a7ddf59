"""Subcommands of `formation-gnc`, one module each: a docstring for its help, `add_arguments` and `run`."""

COMMANDS = ("sil", "design", "navigate", "replay", "compare", "report", "view", "export", "recover")
