"""`flarewright design colors`: coatings for target ghost colours."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ...errors import ProjectError
from ..common import check_place, console, one_of, print_json, print_remarks, stop_on_interrupt
from ..option_record import with_options
from ..partial_work import partial_work
from ..shared_options import Json, Threads, output_option
from .checks import check_color_fitness, check_films, check_time
from .options import Seed

if TYPE_CHECKING:
    from ...design.coatings.color_genes import ColorMeasure
    from ...design.coatings.colors import Coatings, ColorProblem
    from ...design.solvers.solvers import Choice
    from ...model import Lens, Project
    from ...typing import Floats

EPILOG = (
    'Example, in the project:\n\n\\[\\[design.ghost_targets]]\n\nghost = "4-1"\n\ncolor = [1.0, 0.4, 0.1]\n\n'
    "Then: flarewright design colors shot.toml -o coated.toml --films free"
)


@dataclass(frozen=True, kw_only=True)
class ColorOptions:
    """Options of `flarewright design colors`."""

    project: Annotated[Path, typer.Argument(metavar="PROJECT", help="A project file with a \\[design].")]
    output: Annotated[Path, output_option(metavar="LENS.toml", help="The coated lens.")]
    films: Annotated[
        str,
        typer.Option(
            help="quarter-wave: one per surface; free: any index and thickness; 2 or 3: up to that many free ones."
        ),
    ] = "quarter-wave"
    judge: Annotated[str, typer.Option(help="Colour difference: linear, relative in R, G, B; oklab, perceptual.")] = (
        "linear"
    )
    pair_map: Annotated[
        str | None, typer.Option("--map", metavar="J-I", help="Also draw the possible colours of the ghost J-I.")
    ] = None
    curves: Annotated[
        int | None,
        typer.Option("--curves", metavar="ROW", help="Also draw the reflectance of quarter waves on this row."),
    ] = None
    starts: Annotated[
        int,
        typer.Option(min=1, max=100000, help="Number of descents of ours; more find better coatings (default: 64)."),
    ] = 64
    solver: Annotated[
        str,
        typer.Option(help="Solver: ours, pso, sade, de, de1220, gaco or cmaes; pso:5x30 is 5 islands of 30 per gene."),
    ] = "ours"
    fitness: Annotated[
        str, typer.Option(help="Fitness of evolutionary solvers: ours, or algorithm2 of the thesis.")
    ] = "ours"
    time_s: Annotated[
        float | None,
        typer.Option("--time", help="Seconds (default: 60 for evolutionary solvers, all descents for ours)."),
    ] = None
    seed: Seed = 0
    threads: Threads = None
    as_json: Json = False


@with_options(ColorOptions)
def colors(options: ColorOptions) -> None:
    """Search coatings of surfaces in air that give ghosts their target colours and keep the colours of the others.

    Finished descents are kept beside the output: after an interruption, the same command continues.
    """
    kind, layers = check_films(options.films)
    judge = one_of("--judge", options.judge, ("linear", "oklab"))
    measure = check_color_fitness(options.fitness)
    check_time(60.0 if options.time_s is None else options.time_s)
    check_place(options.output, ".toml")
    if options.output.resolve() == options.project.resolve():
        raise ProjectError(f"{options.output} is the project itself; give -o another name")
    from ...design.coatings.colors import color_problem
    from ...design.solvers.solvers import chosen
    from ...io.project.project_file import read_project

    choice = chosen(options.solver)
    given = read_project(options.project)
    problem, lens = color_problem(given, kind, perceptual=judge == "oklab", layers=layers)
    _check_drawings(options, problem)
    found, cut_off = _search(options, given, problem, lens, choice, measure)
    remarks = [f"wrote {options.output}", *(["ended early; to resume: the same command"] if cut_off else [])]
    if problem.kept:
        rows = ", ".join(str(k) for k in problem.kept)
        remarks.append(f"rows left bare, as cemented surfaces take no film: {rows}")
    if options.pair_map is not None:
        remarks.append(_draw_map(options.output, problem, options.pair_map))
    if options.curves is not None:
        remarks.append(_draw_curves(options.output, problem, options.curves))
    print_remarks(remarks)
    if options.as_json:
        print_json(_data(problem, found))
    else:
        _print(problem, found)


def _check_drawings(options: ColorOptions, problem: ColorProblem) -> None:
    """Raise an error for a map or curves of what the lens does not have."""
    from ...design.coatings.colors import mirrors_of

    names = _names(problem)
    if options.pair_map is not None and options.pair_map not in names:
        raise ProjectError(
            f"--map {options.pair_map!r} is no ghost of this lens on one side of its stop, such as {names[0]}"
        )
    mirrors = mirrors_of(problem.structure)
    if options.curves is not None and options.curves not in mirrors:
        raise ProjectError(
            f"--curves {options.curves} is no glass surface; the glass surfaces of this lens are rows "
            f"{', '.join(str(k) for k in mirrors)}"
        )


def _names(problem: ColorProblem) -> list[str]:
    """Return the names of the ghosts."""
    return [f"{j}-{i}" for j, i in problem.structure.pairs]


def _search(
    options: ColorOptions, project: Project, problem: ColorProblem, lens: Lens, choice: Choice, measure: ColorMeasure
) -> tuple[Coatings, bool]:
    """Search until Ctrl-C and write the lens; return the coatings, and whether it was Ctrl-C."""
    from ...design.coatings.color_genes import colors_with
    from ...design.coatings.colors import coated
    from ...design.solvers.evolution_log import Limits
    from ...io.lens.lens_writer import write_lens
    from ...io.project.project_text import project_text

    time_s = 60.0 if choice.evolves and options.time_s is None else options.time_s
    inputs = [
        project_text(project), lens.model_dump_json(), problem.kind, problem.layers, options.judge, options.starts,
        options.seed,
    ]  # fmt: skip
    with (
        stop_on_interrupt() as asked,
        partial_work(options.output, inputs, "batch of descents", "batches of descents") as steps,
    ):
        found = colors_with(
            choice, problem, limits=Limits(time_s, None, None, asked), starts=options.starts, seed=options.seed,
            measure=measure, threads=options.threads, step=steps.step,
        )  # fmt: skip
        write_lens(coated(lens, problem.rows, problem.kind, found.values), options.output)
        steps.unfinished = asked()
    return found, asked()


def _data(problem: ColorProblem, found: Coatings) -> dict[str, object]:
    """Return the result, ready for JSON."""
    from ...design.coatings.colors import perceived_differences
    from ...design.problem.objective import algorithm_2

    differences = perceived_differences(problem, found.colors)
    return {
        "cost": found.cost,
        "fitness_algorithm2": float(algorithm_2(problem.targets, found.colors)),
        "rows": {
            str(k): _row_data(problem, value) for k, value in zip(problem.rows.tolist(), found.values, strict=True)
        },
        "ghosts": [
            {"ghost": name, "wanted": wanted, "found": got, "oklab_difference": seen}
            for name, wanted, got, seen in zip(
                _names(problem), problem.targets.tolist(), found.colors.tolist(), differences.tolist(), strict=True
            )
        ],
    }


def _row_data(problem: ColorProblem, value: Floats) -> dict[str, object]:
    if problem.kind == "quarter-wave":
        return {"center_wavelength_nm": float(value[0])}
    films = [{"index": float(n), "thickness_nm": float(d)} for n, d in value.reshape(-1, 2) if d > 0.0]
    return dict(films[0]) if problem.layers == 1 else {"films": films}


def _print(problem: ColorProblem, found: Coatings) -> None:
    from rich.table import Table

    from ...design.problem.objective import algorithm_2

    fitness = float(algorithm_2(problem.targets, found.colors))
    out = Table(
        title=f"Algorithm 2: {fitness:.3g} over {len(problem.structure.pairs)} ghosts",
        caption="Red, green, blue as fractions of their sum.",
    )
    for column in ("ghost", "target", "found", "brightness, found / target"):
        out.add_column(column, justify="right", no_wrap=True)
    for name, wanted, got in zip(_names(problem), problem.targets, found.colors, strict=True):
        out.add_row(name, *(" ".join(f"{part:.3f}" for part in c / c.sum()) for c in (wanted, got)),
                    f"{got.sum() / wanted.sum():.3f}")  # fmt: skip
    console().print(out)


def _draw_map(output: Path, problem: ColorProblem, ghost: str) -> str:
    """Draw the possible colours of a ghost beside the lens file; return a remark."""
    import numpy as np

    from ...design.coatings.colors import pair_map
    from ...design.problem.grey_picture import png_bytes
    from ...io.files.atomic_write import write_bytes_atomically

    path = output.with_name(f"{output.stem}.{ghost}.png")
    j, _, i = ghost.partition("-")
    picture = pair_map(problem.n_d, (int(j), int(i)), problem.bounds)
    data = png_bytes(np.repeat(np.repeat(picture, 2, axis=0), 2, axis=1))
    write_bytes_atomically(path, data)
    return f"wrote {path}: first mirror upwards, second to the right, centre wavelengths in 2 nm steps"


def _draw_curves(output: Path, problem: ColorProblem, row: int) -> str:
    """Draw the curves of one row beside the lens file; return a remark."""
    from ...design.coatings.color_chart import channel_chart
    from ...render.plots.svg import write_figure

    path = output.with_name(f"{output.stem}.row-{row}.png")
    write_figure(path, channel_chart(problem.n_d, row, problem.bounds), f"quarter waves on row {row}")
    return f"wrote {path}"
