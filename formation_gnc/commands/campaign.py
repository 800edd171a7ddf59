"""Fly a campaign: many dispersed cases of a scenario, on this machine or a cluster, and one verdict.

The results are a Parquet data set that any number of workers fill, a page and pictures. With --resume a campaign
goes on where it ended. Exit status 3 means that a requirement is not met.
"""

import argparse
import dataclasses
import json
import sys
from pathlib import Path
from textwrap import fill
from time import monotonic
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from formation_gnc.campaign.definition import Campaign, Configuration, find_campaign, load_campaign
from formation_gnc.commands import sil
from formation_gnc.commands.tables import print_table
from formation_gnc.errors import ConfigurationError, nearest

if TYPE_CHECKING:
    from formation_gnc.campaign.dataset import Dataset
    from formation_gnc.campaign.evaluation import Flights, Outcome

NOT_MET_STATUS = 3
"""Exit status of a campaign with a requirement that is not met."""

WIDTH = 27
"""Characters of a line of a requirement in the table."""

SHOWN = ("requirement", "configuration", "verdict", "failures", "allowed", "margin")
"""Columns of the table; the page has all."""

BLOCKS = 256
"""Parts of the data set that a campaign comes in, about."""

LARGEST_BLOCK = 100
"""Cases of a part at most: what a worker loses when it is killed."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("campaign", help="name of a campaign in campaigns/, or its file")
    parser.add_argument("--runs", metavar="N", type=int, help="cases to fly in place of the file's number")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", metavar="N", type=int, help="processes on this machine (default: one per core)")
    where.add_argument("--scheduler", metavar="ADDRESS", help="Dask scheduler that runs already, as tcp://HOST:8786")
    where.add_argument("--scheduler-file", metavar="FILE", help="file that a running Dask scheduler has written")
    parser.add_argument(
        "--out", metavar="DIR", type=Path, help="directory of the results (default: campaign_results/NAME)"
    )
    parser.add_argument("--resume", action="store_true", help="go on with the results in the directory")
    parser.add_argument("--only", metavar="CASE", type=int, help="fly this case alone, and record it")
    parser.add_argument("--variant", metavar="NAME", help="with --only: which configuration (default: the first)")
    parser.add_argument("--bag", metavar="DIR", type=Path, help="with --only: directory to make for the bag")
    parser.add_argument("--on-graph", action="store_true", help="with --only: on the node graph, not in-process")
    parser.add_argument("--json", action="store_true", help="print the verdicts as one JSON object")


def run(options: argparse.Namespace) -> int:
    """Fly, write the page, print the verdicts; or fly one case with a full bag."""
    campaign = load_campaign(find_campaign(options.campaign), options.runs)
    if options.workers is not None and options.workers < 1:
        raise ConfigurationError(f"workers: {options.workers} is not allowed; it must be at least 1")
    directory = options.out or Path("campaign_results") / campaign.name
    if options.only is not None:
        return _fly_one(campaign, directory, options)
    given = {"--variant": options.variant, "--bag": options.bag, "--on-graph": options.on_graph}
    for name, value in given.items():
        if value:
            raise ConfigurationError(f"{name}: has no effect without --only")
    return _fly_all(campaign, directory, options)


def _fly_all(campaign: Campaign, directory: Path, options: argparse.Namespace) -> int:
    from formation_gnc.campaign.dataset import Dataset
    from formation_gnc.campaign.engine import CampaignError, Cluster, fly
    from formation_gnc.campaign.evaluation import Flights, NotAppliedError

    console = Console(stderr=True, highlight=False)
    results = Dataset(directory)
    _open(campaign, results, options.resume, console)
    cluster = Cluster(options.workers, options.scheduler, options.scheduler_file)
    started = monotonic()
    try:
        with _Bar(console, campaign.runs) as bar:
            fly(campaign, results, cluster, bar.show)
        flights = Flights(campaign, results)
        flights.check_drawn()
    except KeyboardInterrupt:
        print(f"formation-gnc: interrupted; {_kept(campaign, results)}", file=sys.stderr)
        return 130
    except CampaignError as error:
        print(f"formation-gnc: {error}; {_kept(campaign, results)}", file=sys.stderr)
        return 1
    except NotAppliedError as error:
        print(f"formation-gnc: {error}", file=sys.stderr)
        return 1
    return _summarise(flights, monotonic() - started, options.json)


def _open(campaign: Campaign, results: "Dataset", resume: bool, console: Console) -> None:
    """Create or check the directory of results; a new campaign is checked to apply its dispersions."""
    from formation_gnc.campaign.application import check_application
    from formation_gnc.campaign.version import software_commit, software_version

    directory = results.directory
    if directory.exists() and (not directory.is_dir() or any(directory.iterdir())):
        manifest = results.manifest
        if manifest["identity"] != campaign.identity:
            raise ConfigurationError(f"results {directory}: are of another campaign, or of this one before a change")
        if results.done():
            if not resume:
                raise ConfigurationError(
                    f"results {directory}: exist already; --resume goes on, --out names another place"
                )
            if manifest["version"] != software_version():
                raise ConfigurationError(
                    f"results {directory}: are of formation_gnc {manifest['version']}, this is {software_version()}"
                )
            return
    elif resume:
        raise ConfigurationError(f"results {directory}: there are none to go on with; leave --resume out")
    with console.status("checking that every dispersion is applied") as status:
        check_application(campaign, status.update)
    block = min(max(campaign.runs // BLOCKS, 1), LARGEST_BLOCK)
    results.create(campaign, software_version(), software_commit(), block)


def _kept(campaign: Campaign, results: "Dataset") -> str:
    done = sum(min(end, campaign.runs) - first for first, end in results.done() if first < campaign.runs)
    return f"{done} of {campaign.runs} cases kept in {results.directory}, --resume goes on"


class _Bar:
    """Progress with rate and time left on a terminal; elsewhere nothing."""

    def __init__(self, console: Console, runs: int) -> None:
        self._first: tuple[float, int] | None = None
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("cases, {task.fields[rate]:.2f} per second, left"),
            TimeRemainingColumn(elapsed_when_finished=True),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task("starting workers", total=runs, rate=0.0)

    def __enter__(self) -> "_Bar":
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def show(self, done: int, workers: str) -> None:
        now = monotonic()
        self._first = self._first or (now, done)
        elapsed, flown = now - self._first[0], done - self._first[1]
        self._bar.update(self._task, description=workers, completed=done, rate=flown / elapsed if elapsed else 0.0)


def _summarise(flights: "Flights", elapsed: float, as_json: bool) -> int:
    from formation_gnc.campaign.order_statistics import Verdict
    from formation_gnc.campaign.report import failed_cases, write_report

    outcomes, campaign = flights.outcomes(), flights.campaign
    page = write_report(flights, outcomes, flights.results.directory / "report.html")
    failed = failed_cases(flights)
    if as_json:
        print(
            json.dumps(
                {
                    "campaign": campaign.name,
                    "scenario": ", ".join(each.stem for each in campaign.scenarios),
                    "runs": campaign.runs,
                    "seed": campaign.seed,
                    "configurations": [each.name for each in campaign.configurations],
                    "requirements": [_as_json(each) for each in outcomes],
                    "raised": len(failed),
                    "wall_time": round(elapsed, 3),
                    "version": flights.results.manifest["version"],
                    "results": str(flights.results.directory),
                    "page": str(page),
                },
                indent=2,
            )
        )
    else:
        _print(Console(highlight=False), campaign, outcomes, len(failed), elapsed, page)
    return NOT_MET_STATUS if any(each.verdict is Verdict.NOT_MET for each in outcomes) else 0


def _as_json(outcome: "Outcome") -> dict[str, Any]:
    return {
        name: None if isinstance(value, float) and value - value != 0.0 else value
        for name, value in dataclasses.asdict(outcome).items()
    }


def _print(
    console: Console, campaign: Campaign, outcomes: "list[Outcome]", failed: int, elapsed: float, page: Path
) -> None:
    from formation_gnc.campaign.report import OUTCOME_HEAD, outcome_row

    rows = [dict(zip(OUTCOME_HEAD, outcome_row(each), strict=True)) for each in outcomes]
    shown = [name for name in SHOWN if name != "configuration" or len(campaign.configurations) > 1]
    columns = [[name, *(fill(row[name], WIDTH) for row in rows)] for name in shown]
    if rows:
        print_table(console, columns, f"{campaign.name}, {campaign.runs} cases")
    flights = campaign.runs * len(campaign.configurations)
    raised = f", {failed} raised" if failed else ""
    console.print(f"{flights} flights{raised}, {elapsed:.0f} s")
    console.print(f"page: {page}\nresults: {page.parent}", soft_wrap=True)


def _fly_one(campaign: Campaign, directory: Path, options: argparse.Namespace) -> int:
    """Fly a case with a full bag; its figures are compared with those of the results, where there are some."""
    from formation_gnc.campaign.case import scenario_of

    if not 0 <= options.only < campaign.runs:
        raise ConfigurationError(f"only: {options.only} is not allowed; it must be from 0 to {campaign.runs - 1}")
    configuration = _configuration(campaign, options.variant)
    scenario = scenario_of(campaign, options.only, configuration)
    bag = options.bag or Path("bags") / f"{campaign.name}_{options.only}"
    given = {"bag": bag, "json": options.json, "in_process": not options.on_graph, "accept_lost": True}
    parser = argparse.ArgumentParser()
    sil.add_arguments(parser)
    usual = vars(parser.parse_args([scenario.name]))
    status = sil.fly(scenario, argparse.Namespace(**usual | given))
    if status == 0 and directory.is_dir():
        _compare(campaign, directory, options.only, configuration.name, bag)
    return status


def _configuration(campaign: Campaign, name: str | None) -> Configuration:
    known = {each.name: each for each in campaign.configurations}
    if name is None:
        return campaign.configurations[0]
    if name not in known:
        raise ConfigurationError(f"variant {name}: unknown; {nearest(name, known)}")
    return known[name]


def _compare(campaign: Campaign, directory: Path, case: int, configuration: str, bag: Path) -> None:
    """Say whether a bag has the figures that the results have for its case."""
    from formation_gnc.campaign.dataset import Dataset
    from formation_gnc.campaign.evaluation import departing_figures

    results = Dataset(directory)
    if results.manifest["identity"] != campaign.identity:
        return
    differing = departing_figures(results, case, configuration, bag)
    if differing is None:
        return
    words = (
        f"differ from those of {directory}: {', '.join(differing)}"
        if differing
        else f"are those of {directory}, bit for bit"
    )
    Console(stderr=True, highlight=False).print(f"case {case}: figures {words}", soft_wrap=True)
