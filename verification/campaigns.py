"""Shipped campaigns: verdicts, paired differences, the same bits whoever flies.

`python -m verification.campaigns DIRECTORY ...` keeps what directories of results say in `verification/campaigns.json`,
with `bits` what the flights of `campaign_bits` do; `python -m verification campaigns` writes the page of it,
docs/verification/campaigns.md. The flights themselves are `formation-gnc campaign NAME --out DIRECTORY`.
"""

import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from formation_gnc.campaign.dataset import TIMING, Dataset
from formation_gnc.campaign.evaluation import Difference, Flights, difference
from formation_gnc.campaign.report import OUTCOME_HEAD, failed_cases, number, outcome_row
from verification import campaign_bits

KEPT = Path(__file__).with_name("campaigns.json")

PAGE = "campaigns.md"

BITS = "bits"

Kept = dict[str, Any]

HEADING = """# Campaigns

Written by `verification/campaigns.py` of flights by `formation-gnc campaign`. What a verdict means, and how it is
reached: [Campaigns](../campaigns.md). A campaign that was not flown in full says so; `--resume` goes on with it.
"""

TEXTS = {
    "leader_follower": "The default scenario over three orbits, dispersed in start, mass, thrust, drag, sensor noise "
    "and dropouts, none of which the flight software is told.",
    "laws": "Eight laws on the same cases. Differences are a law's figure minus LQR's.",
    "noise": "Neokleous' claim (6.3) that H-infinity stands more noise than LQR: of all sensors, over two decades.",
    "consistency": "NEES and NIS over what is expected, means over time and all flights, in the scenarios as shipped.",
    "faults": "Sensors, thrusters and tanks that fail at random times.",
}

PAIRED = ("final_error_m", "rms_error_m", "largest_error_last_orbit_m", "delta_v_m_s")
"""Figures that are compared between configurations on the same cases."""

ASKED = ("largest_error_last_orbit_m", "delta_v_m_s")
"""Figures that decide on the claim of `noise`."""

LEVELS = ("x1", "x3", "x10", "x30", "x100")
"""Of noise, in the names of the configurations of `noise`."""


def pairs_of(names: Sequence[str], campaign: str) -> Iterator[tuple[str, str]]:
    """Configurations that are compared: in `noise` those of the same noise, else all with the first."""
    if campaign == "noise":
        yield from ((f"hinf {level}", f"{other} {level}") for other in ("lqr", "firm lqr") for level in LEVELS)
    elif campaign == "laws":
        yield from ((name, names[0]) for name in names[1:])


def read(directory: Path) -> tuple[str, Kept]:
    """Name of a campaign, and what its results say."""
    results = Dataset(directory)
    done = sum(end - first for first, end in results.done())
    asked, campaign = results.campaign(), results.campaign(done)
    missing = next(results.missing(done, done), None)
    if missing is not None:
        raise ValueError(f"{directory}: cases {missing} are missing among those that are there")
    flights = Flights(campaign, results)
    flights.check_drawn()
    wall = [each for each in results.table(["wall_time_s"], TIMING)["wall_time_s"].to_pylist() if each]
    names = [each.name for each in campaign.configurations]
    pairs = [
        asdict(found)
        for figure in PAIRED
        for one, other in pairs_of(names, campaign.name)
        if (found := difference(flights, figure, one, other)) is not None
    ]
    return campaign.name, {
        "cases": done,
        "asked": asked.runs,
        "commit": results.manifest["commit"],
        "configurations": names,
        "raised": len(failed_cases(flights)),
        "wall_median_s": round(float(np.median(wall)), 2),
        "wall_sum_h": round(sum(wall) / 3600.0, 2),
        "verdicts": [outcome_row(each) for each in flights.outcomes()],
        "pairs": pairs,
    }


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Markdown table."""
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|", *(f"| {' | '.join(row)} |" for row in rows)]
    return "\n".join(lines).replace("<", "&lt;")


def section(name: str, kept: Kept) -> str:
    """Part of the page of a campaign."""
    flown = f"{kept['cases']} cases" if kept["cases"] == kept["asked"] else f"{kept['cases']} of {kept['asked']} cases"
    count = len(kept["configurations"])
    flown += f" in {count} configurations" if count > 1 else ""
    lines = [
        f"## {name}",
        f"{TEXTS.get(name, '')} {flown} were flown, {kept['raised']} flights raised; a flight took "
        f"{kept['wall_median_s']} s (median; one worker beside other work), all together {kept['wall_sum_h']} h.",
    ]
    single = count == 1
    head = [each for each in OUTCOME_HEAD if not (single and each == "configuration")]
    rows = [[cell for key, cell in zip(OUTCOME_HEAD, row, strict=True) if key in head] for row in kept["verdicts"]]
    lines.append(table(head, rows))
    pairs = [Difference(**each) for each in kept["pairs"]]
    if pairs:
        cells = [
            [
                *(each.figure, f"{each.configuration} - {each.reference}", number(each.mean)),
                *(f"{number(each.low)} to {number(each.high)}", f"{each.better:.0%}", str(each.cases)),
            ]
            for each in pairs
        ]
        lines.append(table(("figure", "pair", "mean difference", "95 % confidence", "less in", "cases"), cells))
    if name == "noise":
        lines.append(claim(kept, pairs))
    return "\n\n".join(lines) + "\n"


def claim(kept: Kept, pairs: Sequence[Difference]) -> str:
    """Verdict on Neokleous' claim."""
    met: dict[str, list[str]] = {}
    for row in kept["verdicts"]:
        law, _, level = row[1].rpartition(" ")
        met.setdefault(f"{law}: {row[0].split(' <')[0]}", []).extend([level] if row[2] == "met" else [])
    stands = "; ".join(f"{words} up to {levels[-1]}" if levels else f"{words} nowhere" for words, levels in met.items())
    fair = [each for each in pairs if each.reference.startswith("firm") and each.figure in ASKED]
    worse = [_words(each) for each in fair if each.low > 0.0]
    better = [_words(each) for each in fair if each.high < 0.0]
    verdict = "reproduced" if better and not worse else "differs"
    return (
        f"Requirements met: {stands}.\n\nBeside LQR that spends the same at the scenario's noise, H-infinity is worse, "
        f"with 95 % confidence, in {', '.join(worse) or 'nothing'}; better in {', '.join(better) or 'nothing'}. "
        f"**The claim: {verdict}.** Both laws are linear and stable, and noise comes through the filter: more of it "
        "scales the answer of either and destabilises neither, so that what they stand is a matter of weights. "
        "Neokleous' noise was on the states, his LQR's weights were others in each case, and he gives no figures of it."
    )


def _words(pair: Difference) -> str:
    return f"{pair.figure} at {pair.configuration.split()[-1]} by {number(abs(pair.mean))}"


def same_bits(rows: Sequence[Sequence[str]]) -> str:
    """Part of the page on bits."""
    words = (
        f"The default campaign, shortened to {campaign_bits.DURATION:g} s and {campaign_bits.RUNS} cases. Digests of\n"
        "the sorted data sets of cases and errors beside those of one worker; what is killed, is so once "
        f"{campaign_bits.KILLED_AT} cases\nare there. Cases flown again alone with a bag, by `--only N --bag DIR` and "
        "`--on-graph`."
    )
    cells = [[*row[:2], row[2] or "the same"] for row in rows]
    return f"## The same bits\n\n{words}\n\n{table(('flown by', 'how it went', 'bits'), cells)}\n"


def kept() -> Kept:
    """What is on record, by campaign."""
    return dict(json.loads(KEPT.read_text())) if KEPT.exists() else {}


def main(directory: Path) -> int:
    """Write the page of what is on record; returns how many flights raised or had other bits."""
    found = kept()
    rows = found.get(BITS, [])
    names = [name for name in TEXTS if name in found] + sorted({*found} - {*TEXTS, BITS})
    missing = [name for name in TEXTS if name not in found]
    lacking = f"Not flown yet, so without a verdict here: {', '.join(missing)}.\n" if missing else ""
    parts = [HEADING, lacking, *(section(name, found[name]) for name in names), *([same_bits(rows)] if rows else [])]
    (directory / PAGE).write_text("\n".join(parts), encoding="utf-8")
    return sum(found[name]["raised"] for name in names) + sum(bool(row[2]) for row in rows)


if __name__ == "__main__":
    on_record = kept()
    for word in sys.argv[1:]:
        name, values = (BITS, list(campaign_bits.make())) if word == BITS else read(Path(word))
        on_record[name] = values
        KEPT.write_text(json.dumps(on_record, indent=1) + "\n")
        print(name, values if name == BITS else values["verdicts"])
    main(Path("docs/verification"))
