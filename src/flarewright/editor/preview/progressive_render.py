"""Render a picture at rest in steps: draft, traced preview, final picture, then the places of ghosts."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...model import Project
from ..common.latest_job import Check
from ..session.view_settings import View
from . import render_picture
from .draft_calibration import levels_at, measured, missing, with_node
from .draft_match import Levels, Match, levels_of, matched
from .ghost_picking import PickableGhosts, see
from .picture import DrawnPicture, Grade

if TYPE_CHECKING:
    from .viewport import Screen

# a final picture faster than this needs no draft before it
NO_DRAFT_S = 0.35
# a slower one is preceded by a preview traced at screen quality, which takes a third of the time
PREVIEW_S = 0.4
# above this, the preview is coarser and takes a fifth of the time
COARSE_S = 1.2
# the first final picture includes loading: its time is this multiple of the next
LOADING_FACTOR = 2.0
# above this time, places of ghosts are measured before the final picture, so that the user can pick them early
GHOSTS_FIRST_S = 2.5
# work shorter than PROGRESS_AFTER_S reports no progress; progress is reported_at every PROGRESS_EVERY_S
PROGRESS_AFTER_S, PROGRESS_EVERY_S = 0.6, 0.12


def sharpen(screen: Screen, project: Project, view: View, check: Check) -> None:
    """Render a project for the screen: a draft, the final picture, then the places of its ghosts.

    The last picture of a drag serves as the draft. A slow final picture is preceded by a trace at the accuracy of
    eight bits.

    Parameters
    ----------
    screen : Screen
    project : Project
    view : View
    check : callable
        Raises when a newer job waits.
    """
    _brighten(screen, project, view)
    shown = screen.picture
    if shown is not None and _is_up_to_date(screen, shown, project, view):
        _enlarge(screen, shown, view, check)
        # a drag may have interrupted the calibration
        _calibrate(screen, project, check)
    else:
        _sharpen(screen, shown, project, view, check)


def _brighten(screen: Screen, project: Project, view: View) -> None:
    """Multiply a final picture whose lights have all become brighter alike, as by a slider, instead of drawing it."""
    shown, seen = screen.picture, screen.seen
    if shown is None or seen is None or shown.grade != "final" or view.grey or view.unclipped:
        return
    now = render_picture.pictured(project)
    gain = None if render_picture.pictured(shown.project) == now else render_picture.common_gain(shown.project, project)
    if gain is None or render_picture.pictured(seen.project) != render_picture.pictured(shown.project):
        return
    factor = np.float32(gain)
    haze = None if shown.haze is None else shown.haze * factor
    ghosts = tuple(
        replace(ghost, flux=ghost.flux * gain, peak=ghost.peak * gain, light=ghost.light * factor)
        for ghost in seen.ghosts
    )
    screen.seen = replace(seen, project=project, ghosts=ghosts)
    screen.show(replace(shown, project=project, ghosts=shown.ghosts * factor, rest=shown.rest * factor, haze=haze))
    if screen.match.lights == shown.project.lights:
        # the gains of drafts hold for any brightness
        screen.match = replace(screen.match, lights=project.lights)
    screen.session.tell({"type": "ghosts"})


def _sharpen(screen: Screen, shown: DrawnPicture | None, project: Project, view: View, check: Check) -> None:
    # another lens, project or look gets a new exposure; edits keep it, so that brightness can be compared
    if shown is None and view.found_stops is not None:
        screen.match = Match(exposure_stops=view.found_stops)
    exposures = screen.exposures_of(project)
    other = shown is not None and (
        exposures != screen.exposures_at or render_picture.lens_name(shown.project) != render_picture.lens_name(project)
    )
    known = screen.known_exposure(render_picture.pictured(project)) if other else None
    fresh = known is None and (other or not screen.exposed or (shown is None and view.found_stops is None))
    changed = shown is None or other or not render_picture.same_scene(shown.project, project)
    working = view.grey or view.unclipped
    followed = screen.moved is not None and render_picture.same_scene(screen.moved, project)
    draft: DrawnPicture | None = None
    levels: Levels = ()
    if changed or working or (screen.final_s > NO_DRAFT_S and not followed):
        room = screen.room if working else None
        levels = () if changed else levels_at(screen.match, project)
        draft = render_picture.take(project, "draft", view, room=room, levels=levels)
        check()
        if other and shown is not None and screen.exposed:
            screen.leave(render_picture.pictured(shown.project))
        if known is not None:
            # undo to an earlier lens restores its exposure
            screen.exposed, screen.match = True, Match(exposure_stops=known)
            screen.session.remember(known)
        elif fresh:
            # a picture with equal reflectances has no information on exposure
            plain = render_picture.take(project, "draft", View()) if draft.grey else draft
            screen.match = Match(exposure_stops=_exposure(screen, plain))
        elif changed:
            screen.match = replace(screen.match, levels=(), lights=(), calibration=None)
        if draft.grey and (fresh or shown is None or not shown.grey):
            stops = render_picture.exposure_of(draft, Match()) - screen.match.exposure_stops
            screen.match = replace(screen.match, grey=2.0**stops)
        screen.exposures_at = exposures
        screen.show(draft)
    seen_first = not working and screen.final_s > GHOSTS_FIRST_S
    if not working:
        if screen.final_s > PREVIEW_S:
            _show_soon(screen, project, view, check)
        if seen_first:
            _measure_ghosts(screen, project, "final", check)
        _show_final(screen, project, view, (draft, levels), fresh, check)
    if not seen_first:
        _measure_ghosts(screen, project, "draft" if working else "final", check)
    if not working and screen.seen is not None:
        _match_ghosts(screen, project, view, screen.seen, check)
    check()
    if screen.idle is not None:
        screen.idle()
    if not working:
        _calibrate(screen, project, check)


def _exposure(screen: Screen, picture: DrawnPicture) -> float:
    """Return the exposure for a lens; for a black picture, the previous exposure until a ghost is visible."""
    screen.exposed = not render_picture.has_no_ghosts(picture)
    return render_picture.exposure_of(picture) if screen.exposed else screen.match.exposure_stops


def _show_soon(screen: Screen, project: Project, view: View, check: Check) -> None:
    """Show a project traced at screen quality, unless a newer job waits."""
    progress, hasty = _progress(screen, "traced picture", check), screen.final_s > COARSE_S
    soon = render_picture.take(project, "soon", view, room=screen.room, hasty=hasty, progress=progress)
    check()
    screen.show(soon)
    screen.let_through()


def _show_final(
    screen: Screen, project: Project, view: View, drafted: tuple[DrawnPicture | None, Levels], fresh: bool, check: Check
) -> None:
    """Show the final picture, and derive the gains of drafts from it."""
    draft, levels = drafted
    final = _final(screen, project, view, check)
    check()
    screen.final_s = final.seconds / (LOADING_FACTOR if screen.final_s == math.inf else 1.0)
    if fresh:
        screen.match = replace(screen.match, exposure_stops=_exposure(screen, final))
        if screen.exposed:
            screen.session.remember(screen.match.exposure_stops)
    screen.show(final)
    if draft is None:
        # for the next drag; the picture is shown first
        levels = levels_at(screen.match, project)
        draft = render_picture.take(project, "draft", view, levels=levels)
        check()
    screen.match = matched(draft, final, screen.match, levels)
    screen.session.tell({"type": "matched"})


def _final(screen: Screen, project: Project, view: View, check: Check) -> DrawnPicture:
    return render_picture.take(
        project, "final", view, room=screen.room, progress=_progress(screen, "final picture", check)
    )  # fmt: skip


def _is_up_to_date(screen: Screen, shown: DrawnPicture, project: Project, view: View) -> bool:
    """Return whether the project is drawn and measured already: a drag returned, or the page changed its size."""
    if view.grey or view.unclipped or shown.grade != "final" or screen.seen is None:
        return False
    now = render_picture.pictured(project)
    return render_picture.pictured(shown.project) == now == render_picture.pictured(screen.seen.project)


def _enlarge(screen: Screen, shown: DrawnPicture, view: View, check: Check) -> None:
    """Show the final picture again, at the size that the page has room for."""
    if not render_picture.is_as_large(shown, screen.room):
        shown = _final(screen, shown.project, view, check)
        check()
        screen.final_s = shown.seconds
    screen.show(shown)


def _measure_ghosts(screen: Screen, project: Project, grade: Grade, check: Check) -> None:
    """Measure the places of all ghosts, and notify the page."""
    screen.seen = see(project, grade, _progress(screen, "ghosts", check))
    check()
    screen.session.tell({"type": "ghosts"})


def _match_ghosts(screen: Screen, project: Project, view: View, seen: PickableGhosts, check: Check) -> None:
    """Derive the gain of each ghost in the next drafts from the final picture."""
    drafted = see(project, "draft", lambda *_: check())
    levels = levels_of(*({ghost.name: ghost.flux for ghost in each.ghosts} for each in (drafted, seen)))
    draft = render_picture.take(project, "draft", view, levels=levels)
    check()
    final = screen.picture
    if final is not None:
        screen.match = matched(draft, final, screen.match, levels)
        screen.session.tell({"type": "matched"})


def _calibrate(screen: Screen, project: Project, check: Check) -> None:
    """Calibrate the gains of ghosts at other field angles while the editor is idle."""
    for angle in missing(screen.match.calibration, project):
        node = measured(project, angle, check)
        check()
        screen.match = replace(screen.match, calibration=with_node(screen.match.calibration, node))


def _progress(screen: Screen, what: str, check: Check) -> Any:
    reported_at = time.perf_counter() + PROGRESS_AFTER_S - PROGRESS_EVERY_S

    def step(part: float, _: str) -> None:
        nonlocal reported_at
        check()
        now = time.perf_counter()
        if now - reported_at > PROGRESS_EVERY_S:
            reported_at = now
            screen.session.tell({"type": "progress", "part": part, "what": what})

    return step
