"""The folder of a search: lenses, pictures, a report that needs nothing else, and the search itself."""

from __future__ import annotations

import base64
import html
import os
from math import atan2, cos, sin
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError
from ..io.atomic import write_atomically
from ..io.lens_writer import write_lens
from ..io.project_file import project_text
from ..model import AsLens, Output, Project, Quality
from ..model.design import Design, GhostWish
from .candidate import Outcome
from .constraints import Breach
from .ghosts import evaluate
from .impossible import Obstacle
from .objective import seen
from .picture import disc_picture, png_bytes
from .problem import Problem
from .search import State
from .store import write_state

Floats = NDArray[np.float64]

# place or size of any ghost off by less than this, mm: met, nearly met
MET, NEARLY = 0.005, 0.3


def verdict(outcome: Outcome | None, proven: tuple[Obstacle, ...] = (), conflict: tuple[Breach, ...] = ()) -> str:
    """Say in a word how well the ghosts are met.

    Returns
    -------
    str
        "met", "nearly" or "unsolved"; "impossible" where that is proven; "contradictory" where the hard limits cannot
        be kept together even by a lens of any ghosts, as far as a search tells.
    """
    if proven:
        return "impossible"
    if conflict:
        return "contradictory"
    if outcome is None or outcome.breaks or outcome.lost:
        return "unsolved"
    worst = float(np.abs(outcome.residuals).max())
    return "met" if worst < MET else ("nearly" if worst < NEARLY else "unsolved")


def summary(
    state: State, found: tuple[Outcome, ...], problem: Problem, proven: tuple[Obstacle, ...] = (),
    conflict: tuple[Breach, ...] = (),
) -> dict[str, Any]:  # fmt: skip
    """Return the facts of a search, ready for JSON.

    Parameters
    ----------
    state : State
    found : tuple of Outcome
    problem : Problem
    proven : tuple of Obstacle
        What is known to be impossible.
    conflict : tuple of Breach
        By how much the nearest lens of any ghosts breaks the hard limits, if none was found that keeps them.

    Returns
    -------
    dict
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
    """Return how far the ghost of each target is off."""
    return [
        {
            "target": name, "ghost": f"{j}-{i}", "place_error_mm": float(place), "radius_error_mm": float(size),
            **({} if one.fitness_traced is None else {"lost": name in one.lost}),
        }
        for name, (j, i), (place, size) in zip(problem.objective.names, one.ghosts, one.residuals, strict=True)
    ]  # fmt: skip


def _traced_data(one: Outcome) -> dict[str, float]:
    """Return what tracing told; nothing where nothing was traced."""
    if one.fitness_traced is None:
        return {}
    return {"fitness_traced_before": one.fitness_traced[0], "fitness_traced": one.fitness_traced[1]}


def write_folder(
    folder: Path, project: Project, problem: Problem, state: State, found: tuple[Outcome, ...],
    proven: tuple[Obstacle, ...] = (), conflict: tuple[Breach, ...] = (),
) -> list[str]:  # fmt: skip
    """Write project, search, lenses, pictures and report.

    Parameters
    ----------
    folder : Path
        It is there.
    project : Project
    problem : Problem
    state : State
    found : tuple of Outcome
    proven : tuple of Obstacle
        What is known to be impossible.
    conflict : tuple of Breach
        As in `summary`.

    Returns
    -------
    list of str
        Remarks.

    Raises
    ------
    OutputError
        A file cannot be written.
    """
    remarks: list[str] = []
    write_state(state, folder / "search.json")
    _write_text(folder / "project.toml", project_text(project, folder=folder))
    target = target_pictures(problem, project)
    wanted = png_bytes(target[0])
    sections: list[str] = []
    for number, one in enumerate(found, 1):
        write_lens(one.lens, folder / f"lens-{number}.toml")
        hued = _color_project(project, problem, one, folder / f"lens-{number}.toml")
        if hued is not None:
            path = folder / f"lens-{number}.colors.toml"
            _write_text(path, project_text(hued, folder=folder))
            remarks.append(f"{path.name} wants the wished colours of lens-{number}: flarewright design colors {path}")
        pictures = found_pictures(one, problem, project)
        draft = _draft(folder / f"lens-{number}.png", one, project, remarks)
        sections.append(_section(number, one, problem, wanted, png_bytes(pictures[0]), draft))
    data = summary(state, found, problem, proven, conflict)
    _write_text(folder / "report.html", _page(data, "".join(sections), wanted))
    return remarks


def _color_project(project: Project, problem: Problem, one: Outcome, path: Path) -> Project | None:
    """Return a project that wants the colours of new ghosts, of the lens that makes them; None where none has any."""
    wishes = () if project.design is None else project.design.wishes
    found: dict[str, GhostWish] = {}
    for name, (j, i) in zip(problem.objective.names, one.ghosts, strict=True):
        parts = name.split()
        color = wishes[int(parts[1])].color if parts[0] == "wish" else None
        if color is not None:
            found.setdefault(f"{j}-{i}", GhostWish(ghost=f"{j}-{i}", color=color))
    if not found or project.design is None:
        return None
    design = Design(wishes=tuple(found.values()), bounds=project.design.bounds)
    changed: Project = project.replace(lens=os.fspath(path), design=design, coating=AsLens(), f_number=None, zoom=None)
    return changed


def target_pictures(problem: Problem, project: Project) -> list[Floats]:
    """Draw the wanted ghosts of each light as even discs."""
    aim = problem.objective
    return [
        _discs(aim.targets[aim.spans[light] : aim.spans[light + 1], :2], light, project)
        for light in range(len(aim.slopes))
    ]


def found_pictures(outcome: Outcome, problem: Problem, project: Project) -> list[Floats]:
    """Draw the ghosts of a lens for each light as even discs."""
    aim = problem.objective
    values = evaluate(outcome.structure, outcome.vector[None], aim.entrance)[0]
    return [_discs(seen(values, float(slope)), light, project) for light, slope in enumerate(aim.slopes)]


def _discs(ghosts: Floats, light: int, project: Project) -> Floats:
    x, y = (float(np.tan(np.radians(angle))) for angle in project.lights[light].field_deg)
    azimuth = atan2(y, x)
    half = 0.5 * max(project.camera.sensor)
    # as bright as in the thesis' picture: by one over the height, the smallest that fills a few pixels not clipped
    radii = np.maximum(np.abs(ghosts[:, 1]), half / 100.0)
    levels = np.minimum(half / 20.0 / radii, 1.0) * 0.6
    return disc_picture(ghosts[:, 0], ghosts[:, 1], levels[:, None], (cos(azimuth), sin(azimuth)), half, 256)


def _draft(path: Path, outcome: Outcome, project: Project, remarks: list[str]) -> bytes | None:
    """Render a lens in draft quality: the proof that its file is a lens."""
    from ..io.png import encode_png
    from ..render.display import view
    from ..render.render import render

    width, height = project.camera.size_px
    small = 480.0 / max(width, height, 480)
    camera = project.camera.replace(size_px=(max(1, round(width * small)), max(1, round(height * small))))
    shot = project.replace(
        lens=outcome.lens, camera=camera, quality=Quality(mode="draft", wavelengths=3, paths="same-side"),
        output=Output(layers="beauty", starburst=False), f_number=None, iris=project.iris, design=None,
    )  # fmt: skip
    try:
        rendering = render(shot)
    except FlarewrightError as error:
        remarks.append(f"{path.name} was not rendered: {error}")
        return None
    data = encode_png(view(rendering.layers[0].pixels), {})
    write_atomically(path, lambda temporary: _write_bytes(temporary, data))
    return data


def _section(number: int, one: Outcome, problem: Problem, target: bytes, found: bytes, draft: bytes | None) -> str:
    rows = "".join(
        f"<tr><td>{html.escape(name)}</td><td>{j}-{i}</td><td>{place:+.4f}</td><td>{size:+.4f}</td></tr>"
        for name, (j, i), (place, size) in zip(problem.objective.names, one.ghosts, one.residuals, strict=True)
    )
    rendered = f'<figure><img src="{_inline(draft)}"><figcaption>draft render</figcaption></figure>' if draft else ""
    return (
        f"<h2>Lens {number}</h2><p>fitness {one.fitness:.3g} mm² (best matching), {one.fitness_algorithm1:.3g} "
        f"(Algorithm 1), f/{one.lens.f_number:.3g}, stop at row {one.structure.stop}: "
        f"<code>lens-{number}.toml</code>{html.escape(_glasses(one) + _traced(one) + _broken(one))}</p>"
        f'<figure><img src="{_inline(target)}"><figcaption>wanted</figcaption></figure>'
        f'<figure><img src="{_inline(found)}"><figcaption>found</figcaption></figure>{rendered}'
        "<details><summary>every ghost</summary><table><tr><th>wanted</th><th>ghost</th><th>place off, mm</th>"
        f"<th>radius off, mm</th></tr>{rows}</table></details>"
    )


def _glasses(one: Outcome) -> str:
    """Tell what a lens is made of and what that cost; nothing where any index was allowed."""
    if one.fitness_any_index is None:
        return ""
    listed = ", ".join(f"{row}: {glass}" for row, glass in one.glasses.items())
    return f"; with any index {one.fitness_any_index:.3g} mm²; glass behind row {listed}"


def _broken(one: Outcome) -> str:
    """Tell which hard limits a lens does not keep."""
    if not one.breaks:
        return ""
    return "; it breaks " + ", ".join(f"{each.name} by {each.amount:.2g}" for each in one.breaks)


def _traced(one: Outcome) -> str:
    """Tell how far traced ghosts are off, before and after they were finished; nothing where none was traced."""
    if one.fitness_traced is None:
        return ""
    before, after = one.fitness_traced
    told = f"; finished with traced rays: weighted misfit {before:.3g} before, {after:.3g} now; errors below are traced"
    return told + (f", but of {', '.join(one.lost)} too few rays arrive" if one.lost else "")


def _page(data: dict[str, Any], sections: str, target: bytes) -> str:
    words = {
        "met": "The wanted ghosts are met.",
        "nearly": "The wanted ghosts are nearly met.",
        "impossible": "No lens can meet all wanted ghosts. The nearest are below; a table tells how far each is off.",
        "contradictory": "No lens was found that keeps the hard limits together, not even one of any ghosts. The "
        "nearest are below; each tells what it breaks.",
        "unsolved": "The wanted ghosts are not met: a longer search, more surfaces or wider bounds may help; the table "
        "of a lens tells which ghosts are far off.",
    }
    told = "".join(f"<p>{html.escape(one['reason'])}.</p>" for one in data["impossible"])
    nothing = "" if sections else f'<p>No lens was found.</p><img src="{_inline(target)}">'
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>Flarewright design</title><style>'
        "body{font:15px sans-serif;max-width:60em;margin:2em auto;padding:0 1em;background:#16181c;color:#ddd}"
        "figure{display:inline-block;margin:0 .5em .5em 0}img{max-height:256px}table{border-collapse:collapse}"
        "td,th{padding:.1em .8em;text-align:right}figcaption{color:#999}</style>"
        f"<h1>Flarewright design</h1><p>{words[data['verdict']]} {data['searches']} local searches in "
        f"{data['seconds']:.1f} s, seed {data['seed']}.</p>{told}{nothing}{sections}</html>\n"
    )


def _inline(data: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(data).decode("ascii")


def _write_text(path: Path, text: str) -> None:
    write_atomically(path, lambda temporary: _write_bytes(temporary, text.encode("utf-8")))


def _write_bytes(path: Path, data: bytes) -> None:
    path.write_bytes(data)
