"""Fuzzing through public interfaces: `make fuzz`, seeded and bounded.

An input may be refused by the error that its reader documents; another exception, a value that is not within the
bounds of its record, or a second without an answer is a finding.
"""

import argparse
import random
import sys
from collections.abc import Callable, Iterator
from functools import partial
from time import process_time
from typing import Any

import yaml

from formation_gnc.bounds import violation
from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.schedule import parse_schedule
from formation_gnc.limited_yaml import load_limited
from formation_gnc.messages.conversion import received, to_cdr, type_name
from formation_gnc.parameters import read_yaml
from formation_gnc.plant.faults.plan import plan_faults
from formation_gnc.recording.decode import MessageType, installed_type
from formation_gnc.records import Record
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario
from formation_gnc.transport.subscriptions import first_stamp

LONGEST = 1.0
"""Processor time (s) that an input may take."""

ALLOWED = (ConfigurationError, yaml.YAMLError)

TEXTS = [
    "{at: 3000.0, algorithm: coast}",
    "{at: 1.0, lqr.thrust: 1.0e-3, formation: ring}",
    "{part: thruster, kind: stuck, deputy: deputy1, axis: x, begin: 10.0}",
    "/**:\n  ros__parameters:\n    tick: 1.0\n    deputies: [deputy1, deputy2]\n",
    "a: &a [1, 2]\nb: *a\n",
]
PIECES = [
    "&a ",
    "*a",
    "[",
    "]",
    "{",
    "}",
    ": ",
    "- ",
    "!!python/object:x ",
    "1e999",
    ".nan",
    "0x",
    "'",
    '"',
    "\n",
    "\0",
    "é",
    "? ",
]

Part = tuple[Callable[[Any], Any], Callable[[random.Random], Any]]
"""What takes an input, and what makes one."""


def messages() -> dict[type[Record], list[bytes]]:
    """Messages of a short flight by record."""
    found: dict[type[Record], list[bytes]] = {}
    run = Run(load_scenario("tetrahedral", {"/plant": {"duration": 3.0}}))
    run.fly(lambda _, record: found.setdefault(type(record), []).append(to_cdr(record)))
    return found


def mutated_bytes(chance: random.Random, seeds: list[bytes]) -> bytes:
    """A message with flipped, cut, repeated or inserted bytes."""
    data = bytearray(chance.choice(seeds))
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(data) + 1)
        kind = chance.randrange(5)
        if kind == 0 and at < len(data):
            data[at] ^= chance.randint(1, 255)
        elif kind == 1:
            del data[at:]
        elif kind == 2:
            data[at:at] = chance.randbytes(chance.randint(1, 16))
        elif kind == 3:
            data[at : at + 8] = chance.choice([b"\xff" * 8, bytes(8), b"\0\0\0\0\0\0\xf8\x7f", b"\0\0\0\0\0\0\xf0\xff"])
        else:
            data[at : at + 4] = chance.choice([b"\xff\xff\xff\x7f", b"\xff\xff\xff\xff", b"\1\0\0\0"])
    return bytes(data)


def mutated_text(chance: random.Random) -> str:
    """A text of parameters with pieces taken out, put in and repeated."""
    text = chance.choice(TEXTS)
    for _ in range(chance.randint(1, 5)):
        at, end = sorted((chance.randrange(len(text) + 1), chance.randrange(len(text) + 1)))
        piece = chance.choice([*PIECES, text[at:end]]) * chance.choice([1, 1, 1, 2, 200])
        text = text[:at] + piece + text[chance.choice([at, end]) :]
    return text[:20_000]


def parts() -> dict[str, Part]:
    """All parts by name."""
    plant = load_scenario("leader_follower").plant
    found: dict[str, Part] = {
        "schedules": (lambda text: parse_schedule([text]), mutated_text),
        "faults": (lambda text: plan_faults((text,), plant.deputy, plant.tick_ns), mutated_text),
        "parameter YAML": (read_yaml, mutated_text),
        "bag YAML": (load_limited, mutated_text),
    }
    for record, seeds in messages().items():
        make = partial(mutated_bytes, seeds=seeds)
        found[f"decoder of {record.__name__}"] = partial(_decode, received(record)), make
        found[f"bag reader of {record.__name__}"] = partial(_read, installed_type(type_name(record))), make
        found[f"stamp of {record.__name__}"] = first_stamp, make
    return found


def _decode(decode: Callable[[bytes], Record], data: bytes) -> None:
    if reason := violation(decode(data)):
        raise AssertionError(reason)


def _read(kind: MessageType, data: bytes) -> None:
    if not kind.fits(data):
        raise ConfigurationError("left out, and said")
    kind.arrays([data, data])


def fuzz(inputs: int, seed: int) -> Iterator[tuple[str, int, int, float, list[str]]]:
    """Try so many inputs on each part; yields name, inputs, refused ones, longest time (s) and findings."""
    for name, (take, make) in parts().items():
        chance, refused, longest, findings = random.Random(f"{seed} {name}"), 0, 0.0, list[str]()
        for number in range(inputs):
            given = make(chance)
            begun = process_time()
            try:
                take(given)
            except ALLOWED:
                refused += 1
            except Exception as error:
                findings.append(f"input {number}: {type(error).__name__}: {error}: {given[:200]!r}")
            longest = max(longest, process_time() - begun)
        if longest > LONGEST:
            findings.append(f"an input took {longest:.1f} s")
        yield name, inputs, refused, longest, findings


def main() -> int:
    """Fuzz all parts, print a table and the findings; returns 1 when there are any."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=30_000, help="for each part")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    found = False
    for name, inputs, refused, longest, findings in fuzz(options.inputs, options.seed):
        spent = f"longest {longest * 1e3:7.1f} ms"
        print(f"{name:28} {inputs:9} inputs {refused:9} refused, {spent}, {len(findings)} findings")
        for each in findings[:5]:
            print(f"    {each}")
        found = found or bool(findings)
    return int(found)


if __name__ == "__main__":
    sys.exit(main())
