"""`flarewright design solve` and `design resume`: search lenses for ghost targets."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ...errors import OutputError, ProjectError
from ..common import print_json, print_remark, print_remarks, search_status, stop_on_interrupt
from ..shared_options import Json
from .checks import check_fitness, check_time
from .options import Cluster, Fitness, Lenses, Output, Processes, Restarts, Searches, Seed, Solver, Threads, Time

if TYPE_CHECKING:
    from ...design.finishing.constraints import Breach
    from ...design.solvers.genes import Measure
    from ...design.solvers.pool_search import PoolState
    from ...design.solvers.solvers import Choice
    from ...model import Project
    from ...workflow.searches.lens_search import LensSearch
    from ...workflow.searches.search_folder import FolderSearch, SearchLimits
    from ...workflow.searches.search_restarts import Sharing

EPILOG = (
    "Examples:\n\nflarewright design solve shot.toml -o found --time 60\n\n"
    "flarewright design resume found --time 600\n\n"
    "flarewright design solve shot.toml -o many --restarts 8 --cluster local:4\n\n"
    "flarewright render found/lens-1.toml --light 10,5 -o flare.exr"
)


def solve(
    project: Annotated[Path, typer.Argument(metavar="PROJECT", help="A project file with a \\[design].")],
    output: Output,
    time_s: Time = 60.0,
    seed: Seed = 0,
    lenses: Lenses = 5,
    searches: Searches = None,
    threads: Threads = None,
    solver: Solver = "pools",
    fitness: Fitness = "ours",
    restarts: Restarts = 1,
    processes: Processes = None,
    cluster: Cluster = None,
    as_json: Json = False,
) -> None:
    r"""Search lenses whose ghosts meet the targets of a project.

    Without a \[design] in the project, search other lenses with the same ghosts as its lens. The search is stored every
    10 s: after an interruption, `flarewright design resume DIR` continues it.
    """
    check_time(time_s)
    measure = check_fitness(fitness)
    sharing = _sharing(output, restarts, processes, cluster, threads)
    from ...design.solvers.pool_search import PoolState
    from ...design.solvers.solvers import chosen
    from ...io.project.project_file import read_project
    from ...workflow.searches.search_folder import SearchLimits
    from ...workflow.searches.search_restarts import FOLDER

    choice = chosen(solver)
    given = read_project(project)
    if output.exists() and not output.is_dir():
        raise OutputError(f"{output} is a file; give a folder for the lenses")
    if (output / "search.json").exists():
        raise OutputError(f"{output} holds a search already; resume it with flarewright design resume {output}, or "
                          "choose another folder")  # fmt: skip
    if sharing is not None and any((output / FOLDER).glob("*.json")):
        raise OutputError(f"{output / FOLDER} holds searches of an earlier command; choose another folder")
    limits, state = SearchLimits(time_s, lenses, searches, threads), PoolState(seed, restarts=restarts)
    print_search(output, search(given, output, state, limits, choice=choice, measure=measure, sharing=sharing), as_json)


def resume(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A folder written by design solve.")],
    time_s: Time = 60.0,
    lenses: Lenses = 5,
    searches: Searches = None,
    threads: Threads = None,
    processes: Processes = None,
    cluster: Cluster = None,
    as_json: Json = False,
) -> None:
    """Resume an interrupted search; the result equals that of an uninterrupted one."""
    check_time(time_s)
    from ...design.solvers.search_state import read_search
    from ...io.project.project_file import read_project
    from ...workflow.searches.search_folder import SearchLimits

    state, name = read_search(folder / "search.json")
    sharing = _sharing(folder, state.restarts, processes, cluster, threads)
    limits = SearchLimits(time_s, lenses, searches, threads)
    found = search(read_project(folder / "project.toml"), folder, state, limits, name=name, sharing=sharing)
    print_search(folder, found, as_json)


def _sharing(
    folder: Path, restarts: int, processes: int | None, cluster: str | None, threads: int | None
) -> Sharing | None:
    """Return who works off the restarts; None: there is one search."""
    from ...jobs.cluster.executor import workers_of
    from ...workflow.searches.search_restarts import Sharing

    workers_of(cluster, processes, threads)
    if restarts > 1:
        return Sharing(folder, processes, cluster, print_remark)
    for flag, value in (("processes", processes), ("cluster", cluster)):
        if value is not None:
            raise ProjectError(
                f"--{flag} {value} shares out independent searches, and there is one: start with --restarts 8, "
                f"or omit --{flag}"
            )
    return None


def search(
    project: Project, folder: Path, state: PoolState, limits: SearchLimits, *, name: str | None = None,
    choice: Choice | None = None, measure: Measure = "ours", sharing: Sharing | None = None,
    resume_by: str | None = None,
) -> FolderSearch:  # fmt: skip
    """Search with a display of the progress, until Ctrl-C, and print remarks.

    Parameters
    ----------
    project, folder, state, limits, name, choice, measure, sharing
        As for `search_in_folder`.
    resume_by : str, optional
        What the user runs to resume; None: `design resume`.
    """
    from ...workflow.searches.search_folder import search_in_folder

    with stop_on_interrupt() as asked:
        found = search_in_folder(
            project, folder, state, limits, choice=choice, measure=measure, name=name, report=print_remark,
            display=_progress_display, cancelled=asked, sharing=sharing,
        )  # fmt: skip
    print_remarks(found.remarks)
    if found.cut_off:
        print_remark(f"ended early; to resume: {resume_by or f'flarewright design resume {folder}'}")
    return found


def print_search(folder: Path, found: FolderSearch, as_json: bool) -> None:
    """Print the result of a search."""
    if as_json:
        print_json({"folder": str(folder), **found.summary})
        return
    from ...sentences import count

    search, verdict = found.search, found.summary["verdict"]
    lenses = count(len(search.outcomes), "lens", "lenses")
    print(f"{_words(search, verdict)}: {lenses} in {folder}, report in {folder / 'report.html'}")
    for number, one in enumerate(search.outcomes, 1):
        if one.breaks:
            print(f"lens-{number} breaks {_listed(one.breaks, ', ')}")
        if one.fitness_traced is not None:
            print(f"lens-{number}: weighted misfit of traced ghosts {one.fitness_traced[1]:.3g} "
                  f"({one.fitness_traced[0]:.3g} before finishing)"
                  + (f"; too few rays reach {', '.join(one.lost)}" if one.lost else ""))  # fmt: skip
        if one.fitness_any_index is not None:
            print(f"lens-{number}: fitness {one.fitness:.3g} mm^2 with {', '.join(one.glasses.values())} "
                  f"({one.fitness_any_index:.3g} with any index)")  # fmt: skip


def _words(search: LensSearch, verdict: str) -> str:
    """Return what a verdict means for the user."""
    match verdict:
        case "met":
            return "all targets are met"
        case "nearly":
            return "all targets are nearly met"
        case "impossible":
            return "no lens can meet the targets, see above; the nearest are written"
        case "contradictory":
            breaks = _listed(search.conflict, " and ")
            return f"the hard limits contradict each other: the nearest lens with any ghosts breaks {breaks}"
    if search.outcomes and search.outcomes[0].breaks:
        return (
            f"no lens was found that keeps {', '.join(search.problem.bounds.hard)}, though there are some with other "
            "ghosts; search longer, or widen the bounds; the nearest are written"
        )
    return "the targets are not met; the report lists all errors"


def _listed(breaks: Sequence[Breach], joint: str) -> str:
    return joint.join(f"{one.name} by {one.amount:.2g}" for one in breaks)


@contextmanager
def _progress_display(unit: str) -> Iterator[Callable[[PoolState], None] | None]:
    """Show the best result so far on a terminal."""
    with search_status() as update:

        def show(state: PoolState) -> None:
            best = "-" if state.best is None else f"{state.best.cost:.3g}"
            assert update is not None
            update(f"searching: {state.searches} {unit}, best cost {best}")

        yield None if update is None else show
