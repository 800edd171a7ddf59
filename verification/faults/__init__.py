"""Faults with and without supervision: found when, isolated how, and where the flight ends.

`python -m verification.faults [FORMATION or LAW ...]` flies the named ones, or all, keeps what came of every flight in
`flown.csv`, table by table, and writes docs/verification/faults.md from all that is kept.
"""

from collections.abc import Collection, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path

from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.errors import DesignError
from formation_gnc.sil.runner import Run
from verification.faults.flights import FORMATIONS, fly, scenario
from verification.faults.injected import FAULTS
from verification.faults.outcome import HARM, HELD, Outcome, keep, kept
from verification.figure import Figure

DETAILED, OWN_TICK = "lqr", 1.0
"""Law that is flown on the scenario's own ticks too, and those, s."""

TICK = 10.0
"""Tick of all other flights, s: a tenth of the time, and the sensors' own."""

HEADING = f"""# Faults, with and without supervision

Every fault begins after the acquisition of the formation and stays. It is flown without supervision
(`supervisor.enabled: false`), and with it and its default fault table. Errors are of the true position against the
target after the onset, distances the least true ones of any two satellites, delta-v that of the satellite with the
fault. A flight that does not end in `keep` coasts for a day more, with zonal harmonics to degree six: the least
distance to any other satellite must be above {FORMATIONS["leader_follower"].limit:g} m.

A fault does harm if the error without supervision exceeds {HARM:g} m or a separation falls below half of the planned.
Such a fault has to be found before half of that error, and to end `kept` (in `keep`, within {HELD:g} m) or `safe`.
What falls short of that is marked. Flown in-process by `python -m verification.faults`: {DETAILED} on the scenarios'
ticks of {OWN_TICK:g} s, all laws on ticks of {TICK:g} s. Laws with a final time have handed over to LQR by the onset.
A table is flown as a whole and kept; which ones are missing, and why, stands below the first.
"""

HEAD = (
    "| fault | error, m | nearest, m | delta-v, m/s | found first by | after, ticks | answered by | ends in "
    "| largest error, m | at the end, m | nearest, m | a day of coasting, m | delta-v, m/s | outcome |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
)

WITHOUT = "The first three figures are of the flight without supervision, all others of the flight with it."


def wanted(names: Sequence[str] = ()) -> Iterator[tuple[str, str, float]]:
    """Formation, law and tick (s) of each table of the named formations and laws, or of all."""
    formations, laws = ([each for each in every if each in names] or every for every in (FORMATIONS, ALGORITHMS))
    for formation, law in product(formations, laws):
        if law == DETAILED:
            yield formation, law, OWN_TICK
        yield formation, law, TICK


def tables(names: Sequence[str]) -> Iterator[tuple[str, str, float]]:
    """The tables that can be flown: laws that cannot be designed for a formation have none."""
    for formation, law, tick in wanted(names):
        try:
            Run(scenario(formation, law, tick))
        except DesignError:
            continue
        yield formation, law, tick


def fly_table(formation: str, law: str, tick: float, pool: ProcessPoolExecutor) -> list[Outcome]:
    """All faults of a formation and law, without and with supervision."""
    flights = [(formation, law, tick, fault, supervised) for fault in FAULTS for supervised in (False, True)]
    flown = list(pool.map(fly, *zip(*flights, strict=True)))
    pairs = zip(FAULTS, flown[::2], flown[1::2], strict=True)
    return [Outcome.of(formation, law, fault, bare, supervised) for fault, bare, supervised in pairs]


def page(outcomes: Sequence[Outcome]) -> tuple[str, list[Figure]]:
    """The page, and the number of faults that fall short in each table as figures."""
    by_table = dict[tuple[str, str, float], list[Outcome]]()
    for each in outcomes:
        by_table.setdefault((each.formation, each.law, each.tick), []).append(each)
    lines, figures = [HEADING], list[Figure]()
    lines += [
        "## All laws",
        "",
        "| formation | law | tick, s | faults | harmful without | found late or not | short | which |",
    ]
    lines.append("|---|---|---|---|---|---|---|---|")
    for (formation, law, tick), rows in by_table.items():
        short = [row for row in rows if row.falls_short]
        late = sum(row.is_late for row in rows)
        harmful = sum(row.is_harmful for row in rows)
        which = "; ".join(row.fault for row in short) or "none"
        cells = formation, law, f"{tick:g}", len(rows), harmful, late, len(short), which
        lines.append(f"| {' | '.join(map(str, cells))} |")
        figures.append(Figure(f"{formation}, {law}, {tick:g} s: short", "0", len(short), "faults", 0.0, 0.0))
    lines += ["", *missing(by_table)]
    for (formation, law, tick), rows in by_table.items():
        if law == DETAILED:
            lines += [
                "",
                f"## {formation}, {law}, ticks of {tick:g} s",
                "",
                WITHOUT,
                "",
                HEAD,
                *(row.line for row in rows),
            ]
    for formation in FORMATIONS:
        by_law = {key[1]: rows for key, rows in by_table.items() if key[::2] == (formation, TICK)}
        lines += ["", *matrix(formation, by_law)] if by_law else []
    return "\n".join(lines).rstrip() + "\n", figures


def missing(flown: Collection[tuple[str, str, float]]) -> Iterator[str]:
    """Lines of what is not flown: laws that a formation's scenario refuses, with the reason, and the others."""
    for formation, law, tick in wanted():
        if (formation, law, tick) not in flown:
            try:
                Run(scenario(formation, law, tick))
                yield f"- {formation}, {law}, {tick:g} s: not flown"
            except DesignError as error:
                yield f"- {formation}, {law}, {tick:g} s: refused, {error}"


def matrix(formation: str, by_law: dict[str, list[Outcome]]) -> Iterator[str]:
    """Lines of the table of all laws: how each fault ends, with the largest error before and after, m."""
    yield f"## {formation}, all laws, ticks of {TICK:g} s\n"
    yield "Largest error without and with supervision, m, and the outcome.\n"
    yield f"| fault | {' | '.join(by_law)} |"
    yield f"|---{'|---' * len(by_law)}|"
    for place, fault in enumerate(FAULTS):
        yield f"| {fault.words} | {' | '.join(rows[place].short_words for rows in by_law.values())} |"


def main(output: Path, names: Sequence[str] = ()) -> int:
    """Fly, keep and write the page; the number of tables in which a fault falls short."""
    with ProcessPoolExecutor() as pool:
        for table in tables(names):
            rows = fly_table(*table, pool)
            keep(rows)
            short = [row.fault for row in rows if row.falls_short]
            print(*table, f"{len(short)} short: {', '.join(short)}", flush=True)
            text, figures = page(kept())
            (output / "faults.md").write_text(text)
    return sum(not figure.holds for figure in figures)
