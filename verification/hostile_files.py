"""Hostile files given to every command that reads files: status, time, and what is said; no hang, no traceback.

`python -m verification hostile_files` writes docs/verification/hostile_files.md.
"""

import csv
import io
import json
import os
import re
import signal
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from formation_gnc.cli import main as command
from formation_gnc.recording.reader import Bag
from formation_gnc.sil.recorded_flight import fly
from formation_gnc.sil.scenario import find_scenario, load_scenario
from verification.hostile import bags, texts

KEPT = Path(__file__).with_suffix(".csv")

LONGEST, GIVEN_UP = 5.0, 30.0
"""Processor time that a command may take, and wall time after which it is ended, s."""

FIGURES = ("compare", "navigate")
"""Commands whose figures are held to those of the whole bag; what is exported is what is in the file."""

ALLOWED = (0, 1, 2, 3)
ESCAPED = Path("/tmp/formation_gnc_escaped")

BAG_COMMANDS = {
    "report": ["report", "FILE", "--output", "OUT/report.html"],
    "export": ["export", "FILE", "--output", "OUT/tables", "--attachments"],
    "compare": ["compare", "FILE", "WHOLE", "--json"],
    "navigate": ["navigate", "FILE", "--json"],
    "replay": ["replay", "FILE", "--bag", "OUT/again"],
    "recover": ["recover", "FILE", "--output", "OUT/saved"],
}
TEXT_COMMANDS = {
    "check": ["check", "FILE"],
    "design": ["design", "FILE"],
    "sil": ["sil", "FILE", "--in-process", "--duration", "2", "--bag", "OUT/bag", "--accept-lost"],
    "new": ["new", "OUT/own", "--from", "FILE"],
    "navigate": ["navigate", "WHOLE", "--params", "FILE"],
    "replay": ["replay", "WHOLE", "--params", "FILE", "--bag", "OUT/again"],
}


@dataclass(frozen=True)
class Answer:
    """What a command did with a file; status None: it was ended, since it did not end."""

    status: int | None
    seconds: float
    output: str
    errors: str
    figures: Any = None
    """What it gave, to be compared with what it gives of the whole bag."""

    @property
    def notes(self) -> list[str]:
        """Remarks on the file, in the output or in its JSON."""
        said = re.findall(r"^(?:note|skipped|damaged|lost|differs).*", self.output, re.MULTILINE)
        printed = _printed(self.output)
        for each in (printed, *printed.get("runs", ())):
            remarks = each.get("remarks", [])
            said += remarks if isinstance(remarks, list) else [line for lines in remarks.values() for line in lines]
        return said

    @property
    def shortcoming(self) -> str:
        """What falls short, in words; empty where nothing does."""
        if self.status is None:
            return f"no end within {GIVEN_UP:g} s"
        if self.seconds > LONGEST:
            return f"{self.seconds:.1f} s"
        if "Traceback" in self.errors or self.status not in ALLOWED:
            return f"status {self.status}: {self.errors.strip().rpartition(chr(10))[2]}"
        if self.status in (1, 2) and not self.output.strip() and self.errors.count("\n") != 1:
            return f"{self.errors.count(chr(10))} lines"
        if len(self.errors) > 1500:
            return f"{len(self.errors)} characters"
        return ""


@dataclass
class Trial:
    """What all commands did with a file."""

    name: str
    answers: dict[str, Answer] = field(default_factory=dict)
    shortcomings: list[str] = field(default_factory=list)

    @property
    def said(self) -> str:
        """The first line that is said, less the path."""
        for answer in self.answers.values():
            for line in (*answer.errors.splitlines()[-1:], *answer.notes):
                return line.removeprefix("formation-gnc: ").removeprefix("note: ")
        return ""

    def row(self, commands: Sequence[str], paths: Sequence[str]) -> str:
        """Line of the table."""
        cells = ["ended" if self.answers[name].status is None else str(self.answers[name].status) for name in commands]
        said = self.said
        for path in paths:
            said = said.replace(path, "")
        said = (
            "".join(letter if letter.isprintable() else "?" for letter in said).replace("|", "\\|").replace("<", "&lt;")
        )
        longest = max(answer.seconds for answer in self.answers.values())
        return f"| {self.name} | {' | '.join(cells)} | {longest:.1f} | {said[:150]}{'...' if len(said) > 150 else ''} |"


def run(arguments: list[str], out: Path) -> Answer:
    """Run a command in a process of its own, a copy of this one."""
    out.mkdir(parents=True, exist_ok=True)
    begun = time.monotonic()
    child = os.fork()
    if child == 0:
        for number, name in ((1, "stdout"), (2, "stderr")):
            os.dup2(os.open(out / name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
        sys.stdout, sys.stderr = (io.TextIOWrapper(os.fdopen(number, "wb"), write_through=True) for number in (1, 2))
        status = 99
        try:
            status = command(arguments)
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 98
        except BaseException:
            sys.excepthook(*sys.exc_info())  # type: ignore[arg-type]
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
    ended, status, used = os.wait4(child, os.WNOHANG)
    while not ended:
        time.sleep(0.01)
        if time.monotonic() - begun > GIVEN_UP:
            os.kill(child, signal.SIGKILL)
        ended, status, used = os.wait4(child, os.WNOHANG)
    code = os.waitstatus_to_exitcode(status)
    texts_said = [(out / name).read_text(errors="replace") for name in ("stdout", "stderr")]
    return Answer(None if code == -signal.SIGKILL else code, used.ru_utime + used.ru_stime, *texts_said, _figures(out))


def _figures(out: Path) -> Any:
    """Figures that a command has printed as JSON; None for none."""
    printed = _printed((out / "stdout").read_text(errors="replace"))
    if "bags" in printed:
        return printed["bags"][0]["figures"]
    return printed.get("deputies", printed.get("runs"))


def _printed(output: str) -> dict[str, Any]:
    """JSON that a command has printed; empty for none."""
    try:
        return dict(json.loads(output))
    except (ValueError, TypeError):
        return {}


def filled(arguments: list[str], file: Path, whole: Path, out: Path) -> list[str]:
    """Arguments of a command for a file."""
    places = {"FILE": str(file), "WHOLE": str(whole), "OUT": str(out)}
    return [re.sub("FILE|WHOLE|OUT", lambda found: places[found.group()], word) for word in arguments]


def try_all(name: str, file: Path, whole: Path, commands: dict[str, list[str]], expected: dict[str, Any]) -> Trial:
    """Give a file to all commands; figures that are others than of the whole bag have to be said to be."""
    trial = Trial(name)
    with tempfile.TemporaryDirectory(prefix="formation_gnc-verify-") as directory:
        for each, arguments in commands.items():
            out = Path(directory) / each
            answer = run(filled(arguments, file, whole, out), out)
            trial.answers[each] = answer
            if answer.shortcoming:
                trial.shortcomings.append(f"{each}: {answer.shortcoming}")
            is_other = answer.status == 0 and answer.figures is not None and answer.figures != expected.get(each)
            if is_other and each in FIGURES and expected and not answer.notes and name not in bags.BELIEVED:
                trial.shortcomings.append(f"{each}: other figures, without a word")
    if ESCAPED.exists():
        trial.shortcomings.append("wrote a file elsewhere")
        ESCAPED.unlink()
    return trial


def _warm_up(whole: Path, out: Path) -> None:
    """Let this process import and compile what its copies will run."""
    scenario = find_scenario("leader_follower")
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        for number, arguments in enumerate(BAG_COMMANDS.values()):
            command(filled(arguments, whole, whole, out / f"bag{number}"))
        for number, arguments in enumerate(TEXT_COMMANDS.values()):
            place = out / f"text{number}"
            place.mkdir(parents=True, exist_ok=True)
            command(filled(arguments, scenario, whole, place))


def trials(names: Sequence[str] = ()) -> Iterator[tuple[str, Trial, str]]:
    """Try every file, or those named; yields which table it belongs to, its trial, and a path to leave out."""
    with tempfile.TemporaryDirectory(prefix="formation_gnc-verify-") as directory:
        place = Path(directory)
        whole = fly(load_scenario("leader_follower", {"/plant": {"duration": 60.0}}), place / "whole").path
        content, file = bags.Content.of(next(whole.glob("*.mcap"))), place / "chunks.mcap"
        content.write(file)  # a flight of a minute is one chunk
        assert Bag(file).remarks == []
        _warm_up(whole, place / "warm")
        usual = try_all("whole", whole, whole, BAG_COMMANDS, {})
        assert not usual.shortcomings, usual.shortcomings
        expected = {name: answer.figures for name, answer in usual.answers.items()}
        yield "bags", usual, directory
        for number, name in enumerate(bags.BAGS):
            if not names or any(each in name for each in names):
                path = bags.make(name, file, place / f"bag{number}")
                yield "bags", try_all(name, path, whole, BAG_COMMANDS, expected), str(path)
        for number, name in enumerate(texts.TEXTS):
            if not names or any(each in name for each in names):
                path = texts.make(name, place / f"text{number}")
                yield "texts", try_all(name, path, whole, TEXT_COMMANDS, {}), str(path)


def page(rows: dict[str, list[str]], shortcomings: list[str]) -> str:
    """The page of all files."""
    tables = {}
    for name, commands in (("bags", BAG_COMMANDS), ("texts", TEXT_COMMANDS)):
        head = f"| file | {' | '.join(commands)} | longest, s | what is said first |\n|{'---|' * (len(commands) + 3)}"
        tables[name] = "\n".join([head, *rows[name]])
    short = "\n".join(f"- {line}" for line in shortcomings) or "None."
    return f"""# Hostile files

`python -m verification hostile_files` makes {len(rows["bags"]) - 1} hostile bags of a flight of a minute, and
{len(rows["texts"])} hostile parameter files, and gives each to six commands, in a process of its own. A cell is the
exit status, *longest* the most processor time that a command took, on a machine that did other things too. What falls
short is a command that does not end within {GIVEN_UP:g} s, or takes more than {LONGEST:g} s of the processor; a
traceback; an error of more than a line; a file written elsewhere; and figures of `compare` or `navigate` that are
others than those of the whole bag, without a word.

Files that are well formed, with right checksums, are shown as what they are: {", ".join(bags.BELIEVED)}.
Where it is an output of the software that was altered, `replay` says so.

## What falls short

{short}

## Bags

{tables["bags"]}

## Parameter files

{tables["texts"]}
"""


def kept() -> dict[tuple[str, str], dict[str, str]]:
    """Rows on record, by table and file."""
    if not KEPT.exists():
        return {}
    with KEPT.open(newline="", encoding="utf-8") as stream:
        return {(row["table"], row["file"]): row for row in csv.DictReader(stream)}


def keep(row: dict[str, str]) -> None:
    """Put a row on record, in the order of the files."""
    rows = kept() | {(row["table"], row["file"]): row}
    order = [("bags", "whole"), *(("bags", name) for name in bags.BAGS), *(("texts", name) for name in texts.TEXTS)]
    with KEPT.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, ["table", "file", "row", "short"], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows[each] for each in order if each in rows)


def main(directory: Path, names: Sequence[str] = (), makes: bool = True) -> int:
    """Try every file, or those named, and write the page of all on record; returns how much falls short."""
    for table, trial, path in trials(names) if makes else ():
        commands = BAG_COMMANDS if table == "bags" else TEXT_COMMANDS
        row = trial.row(list(commands), (path, str(Path(path).parent)))
        keep({"table": table, "file": trial.name, "row": row, "short": "; ".join(trial.shortcomings)})
        print(trial.name, trial.shortcomings or "", flush=True)
    rows: dict[str, list[str]] = {"bags": [], "texts": []}
    shortcomings = []
    for (table, name), row in kept().items():
        rows[table].append(row["row"])
        shortcomings += [f"{name}: {row['short']}"] if row["short"] else []
    (directory / "hostile_files.md").write_text(page(rows, shortcomings), encoding="utf-8")
    return len(shortcomings)


if __name__ == "__main__":
    main(Path("docs/verification"), sys.argv[1:])
