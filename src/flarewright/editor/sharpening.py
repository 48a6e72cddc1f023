"""How a picture comes about that waits: drafted, traced for the screen, traced in full; and what is seen where."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..model import Project
from . import studio
from .draft_match import Levels, Match, levels_of, matched
from .jobs import Check
from .ladder import levels_at, measured, missing, with_rung
from .picture import Grade, Picture
from .seen import Seen, see
from .view import View

if TYPE_CHECKING:
    from .screen import Screen

# a lens whose final picture takes less needs no draft in front of it
SOON_S = 0.35
# one whose final picture takes more is first traced as well as a screen can show, which takes a third of the time
LATE_S = 0.4
# of one that takes more than this a third is too long: coarser it takes a fifth
HASTE_S = 1.2
# the first final picture of all also loads what draws it: it takes so many times as long as the next
LOADING = 2.0
# and one that takes so long is not waited for by whoever clicks on a ghost
SEEN_FIRST_S = 2.5
# what is done sooner than WAIT_S needs no progress told
WAIT_S, TELL_S = 0.6, 0.12


def sharpen(screen: Screen, project: Project, view: View, check: Check) -> None:
    """Draw a project for the screen: a draft, the final picture, then what lies where in it.

    A hand's last picture is as good as a draft. A final picture that takes long is first traced with the detail that
    eight bits show.

    Parameters
    ----------
    screen : Screen
    project : Project
    view : View
    check : callable
        Raises when something newer waits.
    """
    shown = screen.picture
    if shown is not None and _stands(screen, shown, project, view):
        _enlarge(screen, shown, view, check)
        # a hand may have ended that
        _climb(screen, project, check)
    else:
        _sharpen(screen, shown, project, view, check)


def _sharpen(screen: Screen, shown: Picture | None, project: Project, view: View, check: Check) -> None:
    # another lens has an exposure of its own; while one is worked on it is held, so that brightness can be compared
    if shown is None and view.found_stops is not None:
        screen.match = Match(exposure_stops=view.found_stops)
    other = shown is not None and studio.lens_name(shown.project) != studio.lens_name(project)
    known = screen.known_exposure(studio.pictured(project)) if other else None
    fresh = known is None and (other or not screen.exposed or (shown is None and view.found_stops is None))
    changed = shown is None or not studio.same_scene(shown.project, project)
    working = view.grey or view.unclipped
    followed = screen.moved is not None and studio.same_scene(screen.moved, project)
    draft: Picture | None = None
    levels: Levels = ()
    if changed or working or (screen.final_s > SOON_S and not followed):
        room = screen.room if working else None
        levels = () if changed else levels_at(screen.match, project)
        draft = studio.take(project, "draft", view, room=room, levels=levels)
        check()
        if other and shown is not None and screen.exposed:
            screen.leave(studio.pictured(shown.project))
        if known is not None:
            # where undo leads back to another lens, it is shown as it was
            screen.exposed, screen.match = True, Match(exposure_stops=known)
            screen.session.remember(known)
        elif fresh:
            # a grey picture tells nothing of the exposure
            plain = studio.take(project, "draft", View()) if draft.grey else draft
            screen.match = Match(exposure_stops=_exposure(screen, plain))
        elif changed:
            screen.match = replace(screen.match, levels=(), lights=(), ladder=None)
        if draft.grey and (fresh or shown is None or not shown.grey):
            stops = studio.exposure_of(draft, Match()) - screen.match.exposure_stops
            screen.match = replace(screen.match, grey=2.0**stops)
        screen.show(draft)
    seen_first = not working and screen.final_s > SEEN_FIRST_S
    if not working:
        if screen.final_s > LATE_S:
            _show_soon(screen, project, view, check)
        if seen_first:
            _look(screen, project, "final", check)
        _show_final(screen, project, view, (draft, levels), fresh, check)
    if not seen_first:
        _look(screen, project, "draft" if working else "final", check)
    if not working and screen.seen is not None:
        _match_ghosts(screen, project, view, screen.seen, check)
    check()
    if screen.idle is not None:
        screen.idle()
    if not working:
        _climb(screen, project, check)


def _exposure(screen: Screen, picture: Picture) -> float:
    """Find the exposure of a lens; a black picture has none, so that of before is held until a ghost is seen."""
    screen.exposed = not studio.is_dark(picture)
    return studio.exposure_of(picture) if screen.exposed else screen.match.exposure_stops


def _show_soon(screen: Screen, project: Project, view: View, check: Check) -> None:
    """Trace a project as well as a screen can show it, unless something newer waits by then."""
    progress, hasty = _progress(screen, "traced picture", check), screen.final_s > HASTE_S
    soon = studio.take(project, "soon", view, room=screen.room, hasty=hasty, progress=progress)
    check()
    screen.show(soon)
    screen.let_through()


def _show_final(
    screen: Screen, project: Project, view: View, drafted: tuple[Picture | None, Levels], fresh: bool,
    check: Check,
) -> None:  # fmt: skip
    """Trace a project in full, and learn from it how bright drafts shall be."""
    draft, levels = drafted
    final = _final(screen, project, view, check)
    check()
    screen.final_s = final.seconds / (LOADING if screen.final_s == math.inf else 1.0)
    if fresh:
        screen.match = replace(screen.match, exposure_stops=_exposure(screen, final))
        if screen.exposed:
            screen.session.remember(screen.match.exposure_stops)
    screen.show(final)
    if draft is None:
        # for the next hand; the picture does not wait for it
        levels = levels_at(screen.match, project)
        draft = studio.take(project, "draft", view, levels=levels)
        check()
    screen.match = matched(draft, final, screen.match, levels)
    screen.session.tell({"type": "matched"})


def _final(screen: Screen, project: Project, view: View, check: Check) -> Picture:
    return studio.take(
        project, "final", view, room=screen.room, progress=_progress(screen, "final picture", check)
    )  # fmt: skip


def _stands(screen: Screen, shown: Picture, project: Project, view: View) -> bool:
    """Tell whether all is drawn and measured already: a hand came back, or the page has another size."""
    if view.grey or view.unclipped or shown.grade != "final" or screen.seen is None:
        return False
    now = studio.pictured(project)
    return studio.pictured(shown.project) == now == studio.pictured(screen.seen.project)


def _enlarge(screen: Screen, shown: Picture, view: View, check: Check) -> None:
    """Show the final picture once more, as large as the page has room for."""
    if not studio.is_as_large(shown, screen.room):
        shown = _final(screen, shown.project, view, check)
        check()
        screen.final_s = shown.seconds
    screen.show(shown)


def _look(screen: Screen, project: Project, grade: Grade, check: Check) -> None:
    """Find out which ghosts are where, and tell."""
    screen.seen = see(project, grade, _progress(screen, "ghosts", check))
    check()
    screen.session.tell({"type": "ghosts"})


def _match_ghosts(screen: Screen, project: Project, view: View, seen: Seen, check: Check) -> None:
    """Learn from the final picture how bright each ghost of the next drafts shall be."""
    drafted = see(project, "draft", lambda *_: check())
    levels = levels_of(*({ghost.name: ghost.flux for ghost in each.ghosts} for each in (drafted, seen)))
    draft = studio.take(project, "draft", view, levels=levels)
    check()
    final = screen.picture
    if final is not None:
        screen.match = matched(draft, final, screen.match, levels)
        screen.session.tell({"type": "matched"})


def _climb(screen: Screen, project: Project, check: Check) -> None:
    """Learn, while nothing else is to be done, how bright ghosts shall be wherever a hand takes the light."""
    for angle in missing(screen.match.ladder, project):
        rung = measured(project, angle, check)
        check()
        screen.match = replace(screen.match, ladder=with_rung(screen.match.ladder, rung))


def _progress(screen: Screen, what: str, check: Check) -> Any:
    told = time.perf_counter() + WAIT_S - TELL_S

    def step(part: float, _: str) -> None:
        nonlocal told
        check()
        now = time.perf_counter()
        if now - told > TELL_S:
            told = now
            screen.session.tell({"type": "progress", "part": part, "what": what})

    return step
