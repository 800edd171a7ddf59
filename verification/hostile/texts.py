"""Hostile texts in place of a parameter file."""

import os
from collections.abc import Callable
from pathlib import Path

from formation_gnc.limited_yaml import LARGEST, MOST
from verification.hostile.bags import MULTIPLYING, NOISE

Text = str | bytes | Callable[[Path], object]


def under(text: str) -> str:
    """Values of the plant."""
    return f"/plant:\n  ros__parameters:\n    {text}\n"


TEXTS: dict[str, Text] = {
    "aliases that multiply": MULTIPLYING,
    "a mapping that contains itself": "/**: &a\n  ros__parameters: *a\n",
    "a mapping merged into itself": "/**: &a\n  <<: *a\n",
    "an alias of nothing": "a: *b",
    "lists a thousand deep": "[" * 1000 + "]" * 1000,
    "mappings a thousand deep": "{a: " * 1000 + "1" + "}" * 1000,
    "a hundred thousand brackets": "[" * 100_000,
    "too many values": "[" + "1," * (MOST + 1) + "]",
    "too long": "#" * (LARGEST + 1),
    "a tag of Python": "!!python/object/apply:os.system [echo]",
    "a date that does not exist": under("duration: 2026-99-99"),
    "a time that does not exist": under("duration: 2026-01-01 99:99:99"),
    "an integer of ten thousand digits": under(f"seed: {'9' * 10_000}"),
    "a number in base 60 of a thousand places": under(f"seed: {':'.join(['1'] * 1000)}"),
    "a number of base 2 without digits": under("seed: 0b_"),
    "a number of base 16 without digits": under("seed: 0x_"),
    "1e999": under("duration: 1.0e+999"),
    "a duration of no number": under("duration: .nan"),
    "a tick of a nanosecond for a million years": under("tick: 1.0e-9\n    duration: 3.0e+13"),
    "Base64 that is none": under("seed: !!binary '='"),
    "a key that is a list": under("? [a, b]\n    : 1"),
    "a key that is a mapping with itself": under("? &a {a: *a}\n    : 1"),
    "a key twice": under("seed: 1\n    seed: 2"),
    "a set": under("seed: !!set {a, b}"),
    "nothing but a bracket": "[",
    "nothing": "",
    "a list": "- 1",
    "control characters": "/plant:\0\x1b[31m",
    "a name in escapes": "/\x07plant: 1",
    "a name of a hundred thousand characters": f"{'a' * 100_000}: 1",
    "a deputy named as a path": under("deputies: ['../../x']"),
    "ten thousand deputies": under(f"deputies: [{', '.join(f'd{number}' for number in range(10_000))}]"),
    "a thousand schedule entries nested": under(f"schedule: ['{'{at: ' * 500}']"),
    "extends itself": "extends: hostile\n",
    "extends a directory": "extends: /tmp\n",
    "extends /dev/zero": "extends: /dev/zero\n",
    "extends a list": "extends: [a]\n",
    "UTF-16": "/plant: 1\n".encode("utf-16"),
    "no text": NOISE.randbytes(2000),
    "a directory": Path.mkdir,
    "a named pipe": os.mkfifo,
    "a link to /dev/zero": lambda path: path.symlink_to("/dev/zero"),
    "a link to itself": lambda path: path.symlink_to(path),
}
"""What is made, by what it is."""


def make(name: str, place: Path) -> Path:
    """Make a hostile parameter file in a directory; returns its path."""
    place.mkdir(parents=True)
    path, text = place / "hostile.yaml", TEXTS[name]
    if callable(text):
        text(path)
    else:
        path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path
