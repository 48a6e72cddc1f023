"""`flarewright design solve` and `design resume`: search lenses for wanted ghosts."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import OutputError, ProjectError
from .common import interruptible, print_json, tell
from .design_checks import check_fitness, check_time

if TYPE_CHECKING:
    from ..design.candidate import Outcome
    from ..design.constraints import Breach
    from ..design.genes import Measure
    from ..design.problem import Over, Problem
    from ..design.search import State
    from ..design.solvers import Choice
    from ..model import Iris, Project

EPILOG = (
    "Examples:\n\nflarewright design solve shot.toml -o found --time 60\n\n"
    "flarewright design resume found --time 600\n\nflarewright render found/lens-1.toml --light 10,5 -o flare.exr"
)

# part of the time in which lenses are finished with traced rays or glasses
FINISHING = 0.15

Output = Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for lenses and report.")]
Seed = Annotated[int, typer.Option(min=0, help="Begins the random numbers.")]
Time = Annotated[float, typer.Option("--time", help="Seconds to search; Ctrl-C ends it earlier and keeps the best.")]
Lenses = Annotated[int, typer.Option("--lenses", min=1, max=50, help="Write so many distinct lenses.")]
Threads = Annotated[int | None, typer.Option(min=1, help="All cores when left out; the lenses do not depend on it.")]
Searches = Annotated[int | None, typer.Option(min=1, help="End after about so many local searches (evaluations).")]
Solver = Annotated[
    str, typer.Option(help="pools (ours), pso, sade, de, de1220, gaco or cmaes; pso:5x30 is 5 islands of 30 per gene.")
]
Fitness = Annotated[str, typer.Option(help="What a solver sees that evolves: ours, or algorithm1 of the thesis.")]
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
    as_json: Json = False,
) -> None:
    r"""Search lenses whose ghosts land where the project wants them.

    Without a \[design] in the project: other lenses with the same ghosts as its own.
    """
    check_time(time_s)
    measure = check_fitness(fitness)
    from ..design.solvers import chosen
    from ..io.project_file import read_project

    choice = chosen(solver)
    given = read_project(project)
    if output.exists() and not output.is_dir():
        raise OutputError(f"{output} is a file; give a folder for the lenses")
    if (output / "search.json").exists():
        raise OutputError(f"{output} holds a search already; go on with flarewright design resume {output}, or choose "
                          "another folder")  # fmt: skip
    from ..design.search import State as Fresh

    search(given, output, time_s, Fresh(seed), lenses, searches, threads, as_json, choice=choice, measure=measure)


def resume(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A folder that design solve has written.")],
    time_s: Time = 60.0,
    lenses: Lenses = 5,
    searches: Searches = None,
    threads: Threads = None,
    as_json: Json = False,
) -> None:
    """Go on with a search as if it had not been cut off."""
    check_time(time_s)
    from ..design.store import read_state
    from ..io.project_file import read_project

    state = read_state(folder / "search.json")
    search(read_project(folder / "project.toml"), folder, time_s, state, lenses, searches, threads, as_json)


def search(
    project: Project, folder: Path, time_s: float, state: State, lenses: int, searches: int | None,
    threads: int | None, as_json: bool, name: str | None = None,
    choice: Choice | None = None, measure: Measure = "ours", talk: bool = True,
) -> tuple[Problem, tuple[Outcome, ...], dict[str, Any]]:  # fmt: skip
    """Search, write the folder and tell what was found.

    Parameters
    ----------
    project : Project
    folder : Path
    time_s : float
    state : State
        Where to begin.
    lenses : int
    searches : int or None
    threads : int or None
    as_json : bool
    name : str, optional
        Of the lenses; None: after the project's.
    choice : Choice, optional
        None: pools of local minima.
    measure : {"ours", "algorithm1"}
        The fitness that a solver sees that evolves.
    talk : bool
        False: the caller tells what was found.

    Returns
    -------
    problem : Problem
    found : tuple of Outcome
    data : dict
        Facts for JSON.
    """
    from ..design.hunt import until
    from ..design.impossible import obstacles
    from ..design.report import summary, write_folder
    from ..design.solvers import Limits, chosen, make_ready, solve_with
    from ..design.target import problem_of

    problem, settled = problem_of(project)
    _check_fit(state, problem)
    proven = obstacles(problem, project)
    tell([f"impossible: {one.reason}" for one in proven])
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make the folder {folder}: {(error.strerror or str(error)).lower()}") from None
    solver = chosen("pools") if choice is None else choice
    make_ready(solver, problem, measure)
    # rays and glasses take their time, which is part of it
    rest, begun = FINISHING * time_s if problem.traced or problem.glasses is not None else 0.0, time.perf_counter()
    with interruptible() as asked:
        with _telling(solver.unit) as progress:
            state = solve_with(
                solver, problem, limits=Limits(time_s - rest, searches, progress, asked), seed=state.seed,
                measure=measure, threads=threads, state=state,
            ).state  # fmt: skip
        over = until(time_s - (time.perf_counter() - begun), asked)
        found, conflict = _found(state, problem, lenses, name or f"After {settled.lens.name}", settled.iris, over)
    remarks = write_folder(folder, project, problem, state, found, proven, conflict)
    data = summary(state, found, problem, proven, conflict)
    tell([*(settled.remarks if name is None else ()), *remarks])
    if talk and as_json:
        print_json({"folder": str(folder), **data})
    elif talk:
        _print(folder, problem, found, str(data["verdict"]), conflict)
    return problem, found, data


def _found(
    state: State, problem: Problem, count: int, name: str, iris: Iris | None, over: Over
) -> tuple[tuple[Outcome, ...], tuple[Breach, ...]]:
    """Return the best lenses; where none keeps the hard limits the nearest, and what lenses of any ghosts break."""
    from ..design.candidate import nearest_outcomes, outcomes
    from ..design.constraints import without_ghosts

    found = outcomes(state, problem, count=count, name=name, iris=iris, over=over)
    if found or not problem.bounds.hard:
        return found, ()
    nearest = nearest_outcomes(state, problem, count=count, name=name, iris=iris, over=over)
    return nearest, without_ghosts(problem, seed=state.seed)


def _print(
    folder: Path, problem: Problem, found: tuple[Outcome, ...], verdict: str, conflict: tuple[Breach, ...]
) -> None:
    from ..io.sentences import count

    words = {"met": "the wanted ghosts are met", "nearly": "the wanted ghosts are nearly met",
             "impossible": "no lens can do that, as told above; the nearest are written",
             "contradictory": "the hard limits contradict each other: the nearest lens of any ghosts breaks "
                              + " and ".join(f"{one.name} by {one.amount:.2g}" for one in conflict),
             "unsolved": "the wanted ghosts are not met; the report tells how far each is off"}  # fmt: skip
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
                  f"({one.fitness_traced[0]:.3g} before they were finished)"
                  + (f"; too few rays make {', '.join(one.lost)}" if one.lost else ""))  # fmt: skip
        if one.fitness_any_index is not None:
            print(f"lens-{number}: fitness {one.fitness:.3g} mm^2 with {', '.join(one.glasses.values())} "
                  f"({one.fitness_any_index:.3g} with any index)")  # fmt: skip


def _check_fit(state: State, problem: Problem) -> None:
    """Refuse a search that belongs to another project."""
    rows = problem.structures[0].rows
    members = [one for run in state.runs for one in run.members] + list(state.ended)
    if any(one.structure.rows != rows for one in members):
        raise ProjectError("the search was begun for a lens with another number of rows; begin it anew")


@contextmanager
def _telling(unit: str) -> Iterator[Callable[[State], None] | None]:
    """Tell the best so far where someone looks at it."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.status import Status

    with Status("searching", console=Console(stderr=True)) as status:

        def show(state: State) -> None:
            best = "-" if state.best is None else f"{state.best.cost:.3g}"
            status.update(f"searching: {state.searches} {unit}, best cost {best}")

        yield show
