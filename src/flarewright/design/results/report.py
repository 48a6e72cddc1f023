"""The output folder of a search: project, state, lenses, pictures, and a self-contained HTML report."""

from __future__ import annotations

import os
import re
from math import atan2, cos, sin
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FlarewrightError
from ...io.files.atomic_write import write_bytes_atomically, write_text_atomically
from ...io.images.html_page import html_page
from ...io.lens.lens_writer import write_lens
from ...io.project.project_text import project_text
from ...model import AsLens, Lens, Output, PerRow, Preset, Project, Quality
from ...model.project.design import Design, GhostTarget
from ...sentences import listed
from ...typing import Floats
from ..finishing.candidate import Outcome
from ..finishing.constraints import Breach
from ..problem.ghosts import evaluate
from ..problem.grey_picture import disc_picture, png_bytes
from ..problem.impossible import Obstacle
from ..problem.objective import seen
from ..problem.problem import Problem
from ..solvers.pool_search import PoolState
from ..solvers.search_state import write_state

# largest error of place or size of a ghost, mm: met, nearly met
MET, NEARLY = 0.005, 0.3
_LENS_FILE = re.compile(r"lens-[1-9]\d*\.(?:toml|png|colors\.toml)")
# files that a remark names
_LISTED = 6


def verdict(outcome: Outcome | None, proven: tuple[Obstacle, ...] = (), conflict: tuple[Breach, ...] = ()) -> str:
    """Return in one word how well the targets are met.

    Returns
    -------
    str
        "met", "nearly" or "unsolved"; "impossible" if proven; "contradictory" if a search found no lens, with any
        ghosts, that keeps all hard limits.
    """
    if proven:
        return "impossible"
    if conflict:
        return "contradictory"
    if outcome is None or outcome.breaks or outcome.lost:
        return "unsolved"
    worst = float(np.abs(outcome.residuals).max())
    return "met" if worst < MET else ("nearly" if worst < NEARLY else "unsolved")


def search_summary(
    state: PoolState, found: tuple[Outcome, ...], problem: Problem, proven: tuple[Obstacle, ...] = (),
    conflict: tuple[Breach, ...] = (),
) -> dict[str, Any]:  # fmt: skip
    """Return the facts of a search, ready for JSON.

    Parameters
    ----------
    state : PoolState
    found : tuple of Outcome
    problem : Problem
    proven : tuple of Obstacle
        Targets proven impossible.
    conflict : tuple of Breach
        Violations of the hard limits by the nearest lens with any ghosts, if no lens keeps them.
    """
    return {
        "verdict": verdict(found[0] if found else None, proven, conflict),
        **({"contradictory": {one.name: one.amount for one in conflict}} if conflict else {}),
        "impossible": [
            {"target": one.target, "reason": one.reason, "least_error_mm": one.least_error_mm} for one in proven
        ],
        "seconds": state.seconds,
        "searches": state.searches,
        "seed": state.seed,
        "structures": len(problem.structures),
        "lenses": [
            {
                "file": f"lens-{number}.toml",
                "cost": one.cost,
                "fitness": one.fitness,
                "fitness_algorithm1": one.fitness_algorithm1,
                "f_number": one.lens.f_number,
                "stop_row": one.structure.stop,
                **_traced_data(one),
                **({"breaks": {each.name: each.amount for each in one.breaks}} if one.breaks else {}),
                **(
                    {}
                    if one.fitness_any_index is None
                    else {
                        "fitness_any_index": one.fitness_any_index,
                        "glasses": {str(row): glass for row, glass in one.glasses.items()},
                    }
                ),
                "ghosts": _ghost_data(one, problem),
            }
            for number, one in enumerate(found, 1)
        ],
    }


def _ghost_data(one: Outcome, problem: Problem) -> list[dict[str, Any]]:
    """Return place and size error of the ghost of each target."""
    return [
        {
            "target": name, "ghost": f"{j}-{i}", "place_error_mm": float(place), "radius_error_mm": float(size),
            **({} if one.fitness_traced is None else {"lost": name in one.lost}),
        }
        for name, (j, i), (place, size) in zip(problem.objective.names, one.ghosts, one.residuals, strict=True)
    ]  # fmt: skip


def _traced_data(one: Outcome) -> dict[str, float]:
    """Return the misfits of traced ghosts; empty if none was traced."""
    if one.fitness_traced is None:
        return {}
    return {"fitness_traced_before": one.fitness_traced[0], "fitness_traced": one.fitness_traced[1]}


def write_folder(
    folder: Path, project: Project, problem: Problem, state: PoolState, found: tuple[Outcome, ...],
    proven: tuple[Obstacle, ...] = (), conflict: tuple[Breach, ...] = (), name: str | None = None,
) -> list[str]:  # fmt: skip
    """Write project, search, lenses, pictures and report.

    Parameters
    ----------
    folder : Path
        Existing folder.
    project : Project
    problem : Problem
    state : PoolState
    found : tuple of Outcome
    proven : tuple of Obstacle
        Targets proven impossible.
    conflict : tuple of Breach
        As in `search_summary`.
    name : str, optional
        As in `write_state`.

    Returns
    -------
    list of str
        Remarks for the user.

    Raises
    ------
    OutputError
        When a file cannot be written.
    """
    remarks: list[str] = []
    write_checkpoint(folder, project, state, name)
    target = target_pictures(problem, project)
    wanted = png_bytes(target[0])
    lenses = []
    written: set[str] = set()
    for number, one in enumerate(found, 1):
        write_lens(one.lens, folder / f"lens-{number}.toml")
        written.add(f"lens-{number}.toml")
        hued = _color_project(project, problem, one, folder / f"lens-{number}.toml")
        if hued is not None:
            path = folder / f"lens-{number}.colors.toml"
            write_text_atomically(path, project_text(hued, folder=folder), newline="\n")
            written.add(path.name)
            remarks.append(f"{path.name} has the target colours of lens-{number}: flarewright design colors {path}")
        pictures = found_pictures(one, problem, project)
        draft = _draft(folder / f"lens-{number}.png", one, project, remarks)
        written |= {f"lens-{number}.png"} if draft else set()
        shown = [("target", wanted), ("found", png_bytes(pictures[0])), *([("draft render", draft)] if draft else [])]
        lenses.append((one, shown))
    data = search_summary(state, found, problem, proven, conflict)
    page = html_page(
        "design", title="Flarewright design", data=data, lenses=lenses, names=problem.objective.names, target=wanted
    )
    write_text_atomically(folder / "report.html", page, newline="\n")
    return [*remarks, *_of_earlier_searches(folder, written)]


def _of_earlier_searches(folder: Path, written: set[str]) -> list[str]:
    """Return a remark on files of lenses that a search with more of them has left in the folder."""
    old = sorted(path.name for path in folder.glob("lens-*") if _LENS_FILE.fullmatch(path.name))
    old = [name for name in old if name not in written]
    if not old:
        return []
    are = "is" if len(old) == 1 else "are"
    return [
        f"{listed(old, _LISTED)} in {folder} {are} of an earlier search, and not in this report; delete what you do "
        "not need"
    ]


def write_checkpoint(folder: Path, project: Project, state: PoolState, name: str | None = None) -> None:
    """Write what `flarewright design resume` reads; raises and parameters as `write_folder`."""
    # the search last: a folder with a search can be resumed
    write_text_atomically(folder / "project.toml", project_text(project, folder=folder), newline="\n")
    write_state(state, folder / "search.json", name)


def _color_project(project: Project, problem: Problem, one: Outcome, path: Path) -> Project | None:
    """Return a project for the target colours of new ghosts, with the lens that makes them; None without colours."""
    ghost_targets = () if project.design is None else project.design.ghost_targets
    found: dict[str, GhostTarget] = {}
    for name, (j, i) in zip(problem.objective.names, one.ghosts, strict=True):
        parts = name.split()
        color = ghost_targets[int(parts[1])].color if parts[0] == "target" else None
        if color is not None:
            found.setdefault(f"{j}-{i}", GhostTarget(ghost=f"{j}-{i}", color=color))
    if not found or project.design is None:
        return None
    design = Design(ghost_targets=tuple(found.values()), bounds=project.design.bounds)
    return _with_lens(project, os.fspath(path)).replace(design=design, coating=AsLens())


def _with_lens(project: Project, lens: Lens | str) -> Project:
    """Return a project with a found lens, without what holds only for the rows and gaps of the project's lens.

    The found lens has its own stop, focus and sensor, and stands for the whole of lens, filter and cover glass.
    """
    camera = project.camera.replace(sensor_distance=None, focus_distance=None, cover_glass=None)
    by_row = isinstance(project.coating, Preset | PerRow)
    return project.replace(
        lens=lens, camera=camera, f_number=None, zoom=None, filter=None,
        coating=AsLens() if by_row else project.coating,
    )  # fmt: skip


def target_pictures(problem: Problem, project: Project) -> list[Floats]:
    """Draw the target ghosts of each light as uniform discs."""
    aim = problem.objective
    return [
        _discs(aim.targets[aim.spans[light] : aim.spans[light + 1], :2], light, project)
        for light in range(len(aim.slopes))
    ]


def found_pictures(outcome: Outcome, problem: Problem, project: Project) -> list[Floats]:
    """Draw the ghosts of a lens for each light as uniform discs."""
    aim = problem.objective
    values = evaluate(outcome.structure, outcome.vector[None], aim.entrance)[0]
    return [_discs(seen(values, float(slope)), light, project) for light, slope in enumerate(aim.slopes)]


def _discs(ghosts: Floats, light: int, project: Project) -> Floats:
    x, y = (float(np.tan(np.radians(angle))) for angle in project.lights[light].field_deg)
    azimuth = atan2(y, x)
    half = 0.5 * max(project.camera.sensor)
    # level as in the thesis' picture, proportional to 1 / height; the smallest that fills a few pixels is not clipped
    radii = np.maximum(np.abs(ghosts[:, 1]), half / 100.0)
    levels = np.minimum(half / 20.0 / radii, 1.0) * 0.6
    return disc_picture(ghosts[:, 0], ghosts[:, 1], levels[:, None], (cos(azimuth), sin(azimuth)), half, 256)


def _draft(path: Path, outcome: Outcome, project: Project, remarks: list[str]) -> bytes | None:
    """Render a lens in draft quality, which proves that its file is valid."""
    from ...io.images.png import encode_png
    from ...render.image.display import view
    from ...render.render import render

    project = _with_lens(project, outcome.lens)
    width, height = project.camera.size_px
    small = 480.0 / max(width, height, 480)
    camera = project.camera.replace(size_px=(max(1, round(width * small)), max(1, round(height * small))))
    shot = project.replace(
        camera=camera, quality=Quality(mode="draft", wavelengths=3, paths="same-side"),
        output=Output(layers="beauty", starburst=False), design=None,
    )  # fmt: skip
    try:
        rendering = render(shot)
    except FlarewrightError as error:
        remarks.append(f"{path.name} was not rendered: {error}")
        return None
    data = encode_png(view(rendering.layers[0].pixels), {})
    write_bytes_atomically(path, data)
    return data
