"""`flarewright design colors`: coatings for the colours that ghosts shall have."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from ..errors import ProjectError
from .common import check_place, console, print_json, tell

if TYPE_CHECKING:
    from ..design.colors import ColorProblem

EPILOG = (
    'Example, in the project:\n\n[[design.wishes]]\n\nghost = "4-1"\n\ncolor = [1.0, 0.4, 0.1]\n\n'
    "Then: flarewright design colors shot.toml -o coated.toml --films free"
)


def colors(
    project: Annotated[Path, typer.Argument(metavar="PROJECT", help="A project file with a [design].")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="LENS.toml", help="The coated lens.")],
    films: Annotated[
        str, typer.Option(help="quarter-wave: one of a centre wavelength; free: one of any index and thickness.")
    ] = "quarter-wave",
    judge: Annotated[
        str, typer.Option(help="linear: parts of red, green and blue; oklab: as the eye sees differences.")
    ] = "linear",
    pair_map: Annotated[
        str | None, typer.Option("--map", metavar="J-I", help="Also draw what colours the ghost J-I can have.")
    ] = None,
    curves: Annotated[
        int | None, typer.Option("--curves", metavar="ROW", help="Also draw what quarter waves on this row reflect.")
    ] = None,
    starts: Annotated[int, typer.Option(min=1, max=100000, help="Descents; more find better coatings.")] = 64,
    seed: Annotated[int, typer.Option(min=0, help="Begins the random numbers.")] = 0,
    threads: Annotated[int | None, typer.Option(min=1, help="All cores when left out.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Choose a coating for every surface so that the ghosts have the wished colours, and the others their own."""
    if films not in ("quarter-wave", "free"):
        raise ProjectError(f"--films {films!r} is unknown; choose quarter-wave or free")
    if judge not in ("linear", "oklab"):
        raise ProjectError(f"--judge {judge!r} is unknown; choose linear or oklab")
    check_place(output, ".toml")
    import numpy as np

    from ..design.colors import coated, color_problem, mirrors_of, perceived_differences, solve_colors
    from ..design.colors import pair_map as draw_map
    from ..design.objective import algorithm_2
    from ..design.picture import png_bytes
    from ..io.atomic import write_atomically
    from ..io.lens_writer import write_lens
    from ..io.project_file import read_project

    kind: Literal["quarter-wave", "film"] = "film" if films == "free" else "quarter-wave"
    problem, lens = color_problem(read_project(project), kind, perceptual=judge == "oklab")
    names = [f"{j}-{i}" for j, i in problem.structure.pairs]
    if pair_map is not None and pair_map not in names:
        raise ProjectError(f"--map {pair_map!r} is no ghost of this lens on one side of its stop, such as {names[0]}")
    if curves is not None and curves not in mirrors_of(problem.structure):
        rows = ", ".join(str(k) for k in mirrors_of(problem.structure))
        raise ProjectError(f"--curves {curves}: no glass surface is there; the lens' rows that have one are {rows}")
    found = solve_colors(problem, seed=seed, starts=starts, threads=threads)
    write_lens(coated(lens, problem.structure, kind, found.values), output)
    remarks = [f"wrote {output}"]
    if pair_map is not None:
        map_path = output.with_name(f"{output.stem}.{pair_map}.png")
        picture = draw_map(problem.n_d, problem.structure.pairs[names.index(pair_map)], problem.bounds)
        data = png_bytes(np.repeat(np.repeat(picture, 2, axis=0), 2, axis=1))
        write_atomically(map_path, lambda temporary: _write(temporary, data))
        remarks.append(f"wrote {map_path}: first mirror upwards, second to the right, centre wavelengths in 2 nm steps")
    if curves is not None:
        remarks.append(_draw_curves(output, problem, curves))
    tell(remarks)
    fitness = algorithm_2(problem.targets, found.colors)
    differences = perceived_differences(problem, found.colors)
    if as_json:
        print_json({
            "cost": found.cost,
            "fitness_algorithm2": fitness,
            "rows": {
                str(k): {"center_wavelength_nm": value[0]} if kind == "quarter-wave"
                else {"index": value[0], "thickness_nm": value[1]}
                for k, value in zip(mirrors_of(problem.structure).tolist(), found.values.tolist(), strict=True)
            },
            "ghosts": [
                {"ghost": name, "wanted": wanted, "found": got, "oklab_difference": seen}
                for name, wanted, got, seen in zip(
                    names, problem.targets.tolist(), found.colors.tolist(), differences.tolist(), strict=True
                )
            ],
        })  # fmt: skip
        return
    from rich.table import Table

    out = Table(title=f"Algorithm 2: {fitness:.3g} over {len(names)} ghosts", caption="Red, green, blue: their parts.")
    for column in ("ghost", "wanted", "found", "brightness, found / wanted"):
        out.add_column(column, justify="right", no_wrap=True)
    for name, wanted, got in zip(names, problem.targets, found.colors, strict=True):
        out.add_row(name, *(" ".join(f"{part:.3f}" for part in c / c.sum()) for c in (wanted, got)),
                    f"{got.sum() / wanted.sum():.3f}")  # fmt: skip
    console().print(out)


def _draw_curves(output: Path, problem: ColorProblem, row: int) -> str:
    """Draw the curves of one row beside the lens; return what there is to tell."""
    from ..design.color_chart import channel_chart
    from ..render.figure import write_figure

    path = output.with_name(f"{output.stem}.row-{row}.png")
    write_figure(path, channel_chart(problem.n_d, row, problem.bounds), f"quarter waves on row {row}")
    return f"wrote {path}"


def _write(path: Path, data: bytes) -> None:
    path.write_bytes(data)
