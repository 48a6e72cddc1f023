"""`flarewright design solve` and `design resume`: search lenses for ghost targets."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ...errors import OutputError, ProjectError
from ..common import checkpoints, print_json, print_remark, print_remarks, stop_on_interrupt
from .checks import check_fitness, check_time

if TYPE_CHECKING:
    from ...design.finishing.candidate import Outcome
    from ...design.finishing.constraints import Breach
    from ...design.problem.problem import Problem
    from ...design.solvers.genes import Measure
    from ...design.solvers.pool_search import PoolState
    from ...design.solvers.solvers import Choice
    from ...model import Project
    from ...workflow.search_restarts import Sharing

EPILOG = (
    "Examples:\n\nflarewright design solve shot.toml -o found --time 60\n\n"
    "flarewright design resume found --time 600\n\n"
    "flarewright design solve shot.toml -o many --restarts 8 --cluster local:4\n\n"
    "flarewright render found/lens-1.toml --light 10,5 -o flare.exr"
)

Output = Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for lenses and report.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of the random numbers (default: 0).")]
Time = Annotated[
    float, typer.Option("--time", help="Seconds to search; Ctrl-C ends the search earlier and keeps the best.")
]
Lenses = Annotated[int, typer.Option("--lenses", min=1, max=50, help="Largest number of lenses to write (default: 5).")]
Threads = Annotated[
    int | None, typer.Option(min=1, help="Number of threads, without effect on the lenses (default: all cores).")
]
Searches = Annotated[
    int | None, typer.Option(min=1, help="Approximate number of local searches (evaluations) after which to end.")
]
Restarts = Annotated[
    int,
    typer.Option(
        "--restarts", min=1, max=1000,
        help="Number of independent searches, each of --time and --searches, whose best lenses are merged.",
    ),
]  # fmt: skip
Processes = Annotated[
    int | None, typer.Option(min=1, help="Number of processes that search, for --restarts (default: one per core).")
]
Cluster = Annotated[
    str | None,
    typer.Option(
        metavar="WHERE", help="Search on a Dask cluster, for --restarts: local:N, tcp://HOST:PORT or slurm:FILE."
    ),
]
Solver = Annotated[
    str,
    typer.Option(
        help="Solver: pools (ours), pso, sade, de, de1220, gaco or cmaes; pso:5x30 is 5 islands of 30 per gene."
    ),
]
Fitness = Annotated[str, typer.Option(help="Fitness of evolutionary solvers: ours, or algorithm1 of the thesis.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]


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
    from ...design.solvers.solvers import chosen
    from ...io.project.project_file import read_project
    from ...workflow.search_restarts import FOLDER

    choice = chosen(solver)
    given = read_project(project)
    if output.exists() and not output.is_dir():
        raise OutputError(f"{output} is a file; give a folder for the lenses")
    if (output / "search.json").exists():
        raise OutputError(f"{output} holds a search already; resume it with flarewright design resume {output}, or "
                          "choose another folder")  # fmt: skip
    if sharing is not None and any((output / FOLDER).glob("*.json")):
        raise OutputError(f"{output / FOLDER} holds searches of an earlier command; choose another folder")
    from ...design.solvers.pool_search import PoolState

    search(
        given, output, time_s, PoolState(seed, restarts=restarts), lenses, searches, threads, as_json, choice=choice,
        measure=measure, sharing=sharing,
    )  # fmt: skip


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

    state, name = read_search(folder / "search.json")
    sharing = _sharing(folder, state.restarts, processes, cluster, threads)
    search(
        read_project(folder / "project.toml"), folder, time_s, state, lenses, searches, threads, as_json, name=name,
        sharing=sharing,
    )  # fmt: skip


def _sharing(
    folder: Path, restarts: int, processes: int | None, cluster: str | None, threads: int | None
) -> Sharing | None:
    """Return who works off the restarts; None: there is one search."""
    from ...jobs.cluster.executor import workers_of
    from ...workflow.search_restarts import Sharing

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
    project: Project, folder: Path, time_s: float, state: PoolState, lenses: int, searches: int | None,
    threads: int | None, as_json: bool, name: str | None = None,
    choice: Choice | None = None, measure: Measure = "ours", talk: bool = True,
    resume_by: str | None = None, sharing: Sharing | None = None,
) -> tuple[Problem, tuple[Outcome, ...], dict[str, Any]]:  # fmt: skip
    """Search, write the folder and print the result.

    Parameters
    ----------
    project : Project
    folder : Path
    time_s : float
    state : PoolState
        Start of the search, or a search to resume.
    lenses : int
    searches : int or None
    threads : int or None
    as_json : bool
    name : str, optional
        Name of the lenses; None: after the project's lens.
    choice : Choice, optional
        None: pools of local minima.
    measure : {"ours", "algorithm1"}
        Fitness for evolutionary solvers.
    talk : bool
        False: the caller prints the result.
    resume_by : str, optional
        What the user runs to resume; None: `design resume`.
    sharing : Sharing, optional
        Who works off the restarts of `state`.

    Returns
    -------
    problem : Problem
    found : tuple of Outcome
    data : dict
        Facts for JSON.
    """
    from ...design.results.report import search_summary, write_checkpoint, write_folder
    from ...io.files.atomic_write import make_folder
    from ...workflow.lens_search import search_lenses

    latest, stored = state, state

    def store() -> None:
        nonlocal stored
        if (now := latest) is not stored:
            write_checkpoint(folder, project, now, name)
            stored = now

    def observer(unit: str) -> Callable[[PoolState], None]:
        # the project is valid by now, and the search starts
        make_folder(folder)
        show = watching.enter_context(_progress_display(unit))
        watching.enter_context(checkpoints(store))

        def note(now: PoolState) -> None:
            nonlocal latest
            latest = now
            if sharing is not None and stored is state:
                # restarts keep their own states from now on; this names their number
                store()
            if show is not None:
                show(now)

        return note

    with stop_on_interrupt() as asked, ExitStack() as watching:
        done = search_lenses(
            project, time_s=time_s, state=state, lenses=lenses, searches=searches, threads=threads, choice=choice,
            measure=measure, name=name, report=print_remark, progress=observer, cancelled=asked,
            sharing=sharing,
        )  # fmt: skip
    problem, found, proven, conflict = done.problem, done.outcomes, done.obstacles, done.conflict
    remarks = write_folder(folder, project, problem, done.state, found, proven, conflict, name)
    if asked():
        remarks.append(f"ended early; to resume: {resume_by or f'flarewright design resume {folder}'}")
    data = search_summary(done.state, found, problem, proven, conflict)
    print_remarks([*(done.settled.remarks if name is None else ()), *remarks])
    if talk and as_json:
        print_json({"folder": str(folder), **data})
    elif talk:
        _print(folder, problem, found, str(data["verdict"]), conflict)
    return problem, found, data


def _print(
    folder: Path, problem: Problem, found: tuple[Outcome, ...], verdict: str, conflict: tuple[Breach, ...]
) -> None:
    from ...io.files.sentences import count

    words = {"met": "all targets are met", "nearly": "all targets are nearly met",
             "impossible": "no lens can meet the targets, see above; the nearest are written",
             "contradictory": "the hard limits contradict each other: the nearest lens with any ghosts breaks "
                              + " and ".join(f"{one.name} by {one.amount:.2g}" for one in conflict),
             "unsolved": "the targets are not met; the report lists all errors"}  # fmt: skip
    if found and found[0].breaks and verdict == "unsolved":
        words["unsolved"] = (
            f"no lens was found that keeps {', '.join(problem.bounds.hard)}, though there are some with other ghosts; "
            "search longer, or widen the bounds; the nearest are written"
        )
    print(f"{words[verdict]}: {count(len(found), 'lens', 'lenses')} in {folder}, report in {folder / 'report.html'}")
    for number, one in enumerate(found, 1):
        if one.breaks:
            print(f"lens-{number} breaks {', '.join(f'{each.name} by {each.amount:.2g}' for each in one.breaks)}")
        if one.fitness_traced is not None:
            print(f"lens-{number}: weighted misfit of traced ghosts {one.fitness_traced[1]:.3g} "
                  f"({one.fitness_traced[0]:.3g} before finishing)"
                  + (f"; too few rays reach {', '.join(one.lost)}" if one.lost else ""))  # fmt: skip
        if one.fitness_any_index is not None:
            print(f"lens-{number}: fitness {one.fitness:.3g} mm^2 with {', '.join(one.glasses.values())} "
                  f"({one.fitness_any_index:.3g} with any index)")  # fmt: skip


@contextmanager
def _progress_display(unit: str) -> Iterator[Callable[[PoolState], None] | None]:
    """Show the best result so far on a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.status import Status

    with Status("searching", console=Console(stderr=True)) as status:

        def show(state: PoolState) -> None:
            best = "-" if state.best is None else f"{state.best.cost:.3g}"
            status.update(f"searching: {state.searches} {unit}, best cost {best}")

        yield show
