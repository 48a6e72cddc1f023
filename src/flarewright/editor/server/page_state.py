"""The state of the session as JSON for the page."""

from __future__ import annotations

from typing import Any

from ...errors import FlarewrightError
from ...io.project.spectrum_text import spectrum_text
from ...measure.replay.measured_project import is_measured
from ...model import Design, Project
from ...optics.rays.pack import preset_names
from ...render.image.aces_view import aces_available
from ...render.scene.resolve import open_lens
from ...workflow.keyframes import is_still, length_s
from ..commands.design_targets import ghost_target_names
from ..commands.ghost_rules import override_of, overrides, soloed
from ..commands.lens import prescription, table_of
from ..commands.shot import coating_text, iris_of
from ..common.light_names import light_label
from ..design.search_job import Solver
from ..preview.display_image import FALSE_COLOURS
from ..preview.picture import page_remarks
from ..preview.render_picture import pictured, rest_size, same_ghosts, view_size
from ..preview.viewport import Screen
from ..session.history import History, before_mask, design_before_added, design_before_scratch
from ..session.measured_project import measured_facts, measured_lens
from ..session.plate_finder import PlateFinder


def state_of(screen: Screen, solver: Solver) -> dict[str, Any]:
    """Return the state of the page, without pictures and the table of ghosts.

    Returns
    -------
    dict
        Ready for JSON.
    """
    session = screen.session
    # read before the parts, which another thread may change meanwhile: an older number is corrected by the next state,
    # while older parts under a newer number would stay on the page
    revision = session.revision
    project, history = session.project, session.history
    table = measured_facts(project) if is_measured(project) else prescription(project)
    return {
        "revision": revision,
        "file": session.file,
        "opened": session.opened,
        "clean": session.clean,
        "undo": history.undo_label,
        "redo": history.redo_label,
        "steps": {"at": history.at, "count": len(history.moments)},
        "lens": _lens(project, table.facts, table.problem)
        | {"table": table_of(project), "rows": list(table.rows), "distortion": list(table.distortion)},
        "lights": _lights(project, bool(table.distortion)),
        "camera": project.camera.model_dump(mode="json") | {"sensor": list(project.camera.sensor)},
        "iris": _iris(project, history),
        "dirt": project.dirt.model_dump(mode="json"),
        "starburst": project.starburst.model_dump(mode="json"),
        "holdout": None if project.holdout is None else project.holdout.model_dump(mode="json"),
        "plate": None if project.plate is None else project.plate.model_dump(mode="json") | {"lit": project.plate.lit},
        "path_s": length_s(project),
        "moves": not is_still(project),
        "coating": coating_text(project),
        "quality": project.quality.model_dump(mode="json"),
        "pass_gain": {} if project.art.physical else dict(project.art.gain),
        "solo": [] if project.art.physical else list(soloed(project.art)),
        "by_hand": len(project.art.rules) + len(project.art.gain),
        "design": _design(project, history),
        "view": session.view.model_dump(mode="json") | {"stops": round(screen.exposure_stops, 2)},
        "frame": {
            "size": list(view_size(project)),
            "full": list(rest_size(project, project.camera.size_px)),
            "sensor": list(project.camera.sensor),
        },
        "picture": _picture(screen),
        "solve": solve_of(solver),
        "aces": aces_available(),
        "false_colours": [[stops, "#{:02x}{:02x}{:02x}".format(*colour)] for stops, colour in FALSE_COLOURS],
    }


def _picture(screen: Screen) -> dict[str, Any]:
    shown = screen.picture
    return {
        "number": screen.number,
        "grade": "" if shown is None else shown.grade,
        "seconds": 0.0 if shown is None else round(shown.seconds, 3),
        "problem": screen.problem,
        # whether it shows the present project
        "current": shown is not None and pictured(shown.project) == pictured(screen.session.project),
        # places of its lights: a drag may have moved them during encoding
        "lights": [] if shown is None else [light.field_deg for light in shown.project.lights],
        # part of the picture, so that no older answer replaces those of a newer picture
        "remarks": [] if shown is None else list(page_remarks(shown)),
    }


def picture_of(screen: Screen) -> dict[str, Any]:
    """Return the facts shown beside the picture."""
    return _picture(screen) | {"stops": round(screen.exposure_stops, 2)}


def finding_of(finder: PlateFinder) -> dict[str, Any]:
    """Return the progress of the search for lights in the plate."""
    state = finder.state
    return {"running": state.running, "part": round(state.part, 3), "words": state.words}


def solve_of(solver: Solver) -> dict[str, Any]:
    """Return the progress of the search."""
    progress = solver.fitting
    return {
        "running": progress.running, "words": progress.words, "seconds": round(progress.seconds, 1),
        "number": progress.number, "found": [found.words for found in progress.found],
    }  # fmt: skip


def _lens(project: Project, facts: dict[str, float], problem: str) -> dict[str, Any]:
    if is_measured(project):
        return measured_lens(project) | {"facts": facts, "problem": problem}
    try:
        lens = open_lens(project.lens).lens
    except FlarewrightError:
        if isinstance(project.lens, str):
            return {"name": project.lens, "source": "", "notes": "", "facts": facts, "problem": problem}
        lens = project.lens
    return {
        "name": lens.name, "source": lens.source, "notes": lens.notes, "facts": facts, "problem": problem,
        "open": lens.f_number, "f_number": project.f_number, "zoom": project.zoom,
        "positions": [position.name for position in lens.positions],
        "presets": list(preset_names(lens)), "stop_row": lens.stop_row,
        "shipped": project.lens if isinstance(project.lens, str) else None,
    }  # fmt: skip


def _lights(project: Project, round_lens: bool) -> list[dict[str, Any]]:
    """Return the lights; on a plate, for a lens that is not round, also where they are traced to."""
    found = [_light(project, k) for k in range(len(project.lights))]
    if not project.lit_by_plate or round_lens or is_measured(project):
        return found
    # imports SciPy, which the editor does not need without a plate
    from ...workflow.plates.found_lights import traced_places

    try:
        places = traced_places(project)
    except FlarewrightError:
        return found
    return [light | {"placed": place} for light, place in zip(found, places, strict=True)]


def _light(project: Project, k: int) -> dict[str, Any]:
    light = project.lights[k]
    return {
        "name": light.name, "label": light_label(project, k),
        "field_deg": list(light.field_deg), "intensity": light.intensity,
        "spectrum": spectrum_text(light.spectrum) or light.spectrum.kind, "diameter_deg": light.diameter_deg,
        "distance": light.distance, "shape": None if light.shape is None else light.shape.model_dump(mode="json"),
        "starburst": light.starburst,
        "keys": [{"at_s": key.at_s, "field_deg": list(key.field_deg)} for key in light.keyframes],
        "holdout": None if light.holdout is None else light.holdout.model_dump(mode="json"),
    }  # fmt: skip


def _iris(project: Project, history: History) -> dict[str, Any]:
    try:
        iris, before = iris_of(project), before_mask(history)
        # when blades replace the image again, they have their earlier settings
        turned = None if before is None else iris_of(before).rotation_deg
    except FlarewrightError:
        return {}
    return iris.model_dump(mode="json") | {"turned_before_mask": turned}


def _design(project: Project, history: History) -> dict[str, Any] | None:
    design = project.design
    if design is None:
        return None
    # settings restored when a search from scratch is switched off
    return design.model_dump(mode="json", exclude={"bounds"}) | {
        "names": list(ghost_target_names(design)), "before_scratch": _structure(design_before_scratch(history)),
        # and when the last new ghost, which needs more surfaces, is removed
        "before_added": _structure(design_before_added(history)),
    }  # fmt: skip


def _structure(design: Design | None) -> dict[str, Any] | None:
    return None if design is None else design.model_dump(mode="json", include={"structure", "fixed_rows"})


def ghost_rows(screen: Screen) -> dict[str, Any]:
    """Return the table of ghosts; `fresh` is whether it belongs to the present project.

    Empty while the last measurement belongs to another lens, as its names would refer to other ghosts.
    """
    seen, project = screen.seen, screen.session.project
    if seen is None or not same_ghosts(seen.project, project):
        return {"fresh": False, "ghosts": []}
    brightest = seen.ghosts[0].flux if seen.ghosts else 1.0
    rows = []
    ruled = overrides(project, [ghost.name for ghost in seen.ghosts])
    for ghost in seen.ghosts:
        mine, whole = override_of(project.art, ghost.name), ruled[ghost.name]
        rows.append(
            {
                "name": ghost.name, "share": ghost.flux / brightest, "flux": ghost.flux, "size": ghost.size_mm,
                "centre": list(ghost.centre), "muted": whole.muted, "gain": mine.gain, "tint": list(mine.tint),
                # by all rules, also those of the file that name rows or rank ghosts
                "whole": {"gain": whole.gain, "tint": list(whole.tint)},
            }
        )  # fmt: skip
    return {"fresh": pictured(seen.project) == pictured(project), "ghosts": rows}
