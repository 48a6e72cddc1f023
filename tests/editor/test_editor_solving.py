"""What a search says in the editor; the search itself is tried in tests/design and in the browser."""

import io
import threading
import time
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from flarewright.design.color_search import solve_colors
from flarewright.design.colors import color_problem, own_colors, perceived_differences
from flarewright.editor import draft_match, solving, studio
from flarewright.editor.shown import pixels_of
from flarewright.editor.solving import Seeing, Solver
from flarewright.editor.view import View
from flarewright.errors import ProjectError
from flarewright.model import AsLens, Design, Everywhere, GhostWish, Light, Preset, QuarterWave, Surface
from flarewright.optics.pack import resolve_coatings
from flarewright.render.prepare import as_lens


@pytest.fixture
def project(project, screen_size):
    """The project as simple as the size of the screen asks for."""
    return screen_size(project)


@pytest.fixture
def few_descents(screen_size, monkeypatch):
    """A search of colours makes an eighth of its descents, where the screen is small."""
    if studio.WIDEST < 960:
        monkeypatch.setattr(solving, "solve_colors", partial(solve_colors, starts=8))


class _Session:
    def __init__(self, project):
        self.project = project

    def tell(self, event):
        pass


@pytest.mark.parametrize("possible", [True, False])
def test_what_no_lens_can_do_is_told(project, monkeypatch, possible):
    monkeypatch.setattr(solving, "compile_kernels", lambda picture: None)
    monkeypatch.setattr(solving, "solve", lambda *_, **__: SimpleNamespace(searches=3, seconds=0.1))
    monkeypatch.setattr(solving, "outcomes", lambda *_, **__: ())
    wish = GhostWish(place_mm=1.0, radius_mm=1.0) if possible else GhostWish(at_mm=(0.0, 5.0), radius_mm=1.0)
    design = Design(wishes=(wish,), own_ghosts=False)
    solver = Solver(_Session(project.replace(lights=(Light(field_deg=(5.0, 0.0)),), design=design)))
    solver.start(0.1)
    solver._thread.join(60.0)
    assert not solver.progress.running
    assert solver.progress.words.startswith("No lens was found" if possible else "No lens can do that: added ghost 1")


def test_a_search_that_gets_ready_is_stopped_at_once(project, monkeypatch):
    """The first search of a machine compiles for a minute, which nothing can end: Stop waited for it."""
    compiled, searched = threading.Event(), []
    monkeypatch.setattr(solving, "compile_kernels", lambda picture: compiled.wait(60.0))
    monkeypatch.setattr(solving, "solve", lambda *_, **__: searched.append(1) or SimpleNamespace(searches=1, seconds=0))
    monkeypatch.setattr(solving, "outcomes", lambda *_, **__: ())
    design = Design(wishes=(GhostWish(place_mm=1.0, radius_mm=1.0),), own_ghosts=False)
    solver = Solver(_Session(project.replace(lights=(Light(field_deg=(5.0, 0.0)),), design=design)))
    solver.start(0.1)
    first = solver._thread
    begun = time.perf_counter()
    solver.stop()
    assert time.perf_counter() - begun < 5.0
    assert not solver.progress.running
    assert solver.progress.words.startswith("Stopped")
    # the next one may begin meanwhile, and what was stopped says nothing any more
    solver.start(0.1)
    compiled.set()
    first.join(60.0)
    solver._thread.join(60.0)
    assert searched == [1]
    assert solver.progress.words.startswith("No lens was found")


def test_lenses_are_told_in_words_and_the_best_comes_first(project, monkeypatch):
    """What a person reads beside them is what orders them: the largest error."""

    def found(state, problem, *, name, **_):
        names = problem.objective.names
        at = {one: np.zeros((len(names), 2)) for one in ("far", "near", "met")}
        at["far"][names.index("wish 1")] = 0.1, -2.0
        at["near"][names.index("8-6")] = 0.25, 0.1
        # summed up it is worse than the one before
        at["near"] += 0.2
        return tuple(
            SimpleNamespace(lens=as_lens(project.lens).replace(name=f"{name} 7"), residuals=at[one], breaks=(), lost=())
            for one in ("far", "met", "near")
        )

    monkeypatch.setattr(solving, "compile_kernels", lambda picture: None)
    monkeypatch.setattr(solving, "solve", lambda *_, **__: SimpleNamespace(searches=3, seconds=0.1))
    monkeypatch.setattr(solving, "outcomes", found)
    wishes = (GhostWish(ghost="8-6", move_mm=1.0), GhostWish(place_mm=1.0, radius_mm=1.0))
    solver = Solver(_Session(project.replace(design=Design(wishes=wishes))))
    solver.start(0.1)
    solver._thread.join(60.0)
    words = [one.words for one in solver.progress.found]
    assert [one.partition("; ")[0] for one in words] == [f"Lens {k}: 8 surfaces, 99.2 mm f/3.5" for k in (1, 2, 3)]
    assert words[0].endswith("; met")
    assert words[1].endswith("; not met, ghost 8-6 is farthest off, by 0.45 mm")
    assert words[2].endswith("; not met, added ghost 1 is farthest off, by 2 mm")
    assert [one.changes["lens"].name[-1] for one in solver.progress.found] == ["1", "2", "3"]

    # the same rows wear the same coatings
    worn = resolve_coatings(as_lens(project.lens), project.coating)
    assert any(worn)
    session = solver.session
    puts = []
    session.put = lambda found, label: puts.append(found)
    # the f-number of before is not that of its ghosts, and who chose it is told
    assert solver.accept(0) == (
        "“After Heliar-Tronnier 100 mm f/3.5 1” was accepted; it stands at its own f/3.5, no longer at f/8, for at "
        "that opening its ghosts are as large as was found. What was wished for is taken off the list. Undo brings "
        "all of it back."
    )
    assert puts[0].f_number is None
    assert resolve_coatings(puts[0].lens, puts[0].coating) == tuple(worn)
    # who has taken one may take another; for another lens they are no candidates
    session.project = puts[0]
    assert solver.accept(1).endswith("2” was accepted. Undo brings all of it back.")
    session.project = project.replace(lens="tessar-brendel")
    assert solver.fitting.found == ()
    with pytest.raises(ProjectError, match="another lens"):
        solver.accept(0)
    session.project = project
    assert len(solver.fitting.found) == 3


@pytest.mark.parametrize("coating", [AsLens(), Everywhere(coating=QuarterWave(center_wavelength_nm=550.0))])
def test_a_lens_of_other_rows_wears_what_fits_all(project, coating):
    assert solving._kept(project.replace(coating=coating), as_lens("canon-28-80")) == coating


def test_a_lens_of_other_rows_does_not_wear_those_of_the_one_before(project):
    assert project.coating == Preset(name="thesis")
    assert solving._kept(project, as_lens("canon-28-80")) is None


def test_a_colour_for_a_new_ghost_is_refused_in_the_pages_words(project):
    wishes = (GhostWish(ghost="8-6", color=(1.0, 0.2, 0.1)), GhostWish(place_mm=1.0, radius_mm=1.0))
    solver = Solver(_Session(project.replace(design=Design(wishes=wishes))))
    with pytest.raises(ProjectError, match=r"^added ghost 1 is for a new ghost; colours are chosen for"):
        solver.start_colors("quarter-wave", 30.0)


@pytest.mark.usefixtures("few_descents")
def test_colours_that_are_found_keep_the_shot_as_it_is(project):
    """Only coatings are new: opening, glass and what was changed meanwhile stay."""
    puts = []
    session = _Session(project.replace(design=Design(wishes=(GhostWish(ghost="8-6", color=(1.0, 0.2, 0.1)),))))
    session.put = lambda found, label: puts.append(found)
    solver = Solver(session)
    solver.start_colors("quarter-wave", 30.0)
    solver._thread.join(60.0)
    assert len(solver.progress.found) == 1
    session.project = session.project.replace(lights=(Light(field_deg=(5.0, 0.0)),))
    assert solver.accept(0).startswith("The coatings were accepted; lens, opening and zoom stay as they were. ")
    (found,) = puts
    assert found.coating.kind == "per-row"
    assert found.design is None
    assert found == session.project.replace(coating=found.coating, design=None)


@pytest.mark.usefixtures("few_descents")
def test_how_near_colours_come_is_told_and_cemented_rows_stay_bare(project):
    wishes = (GhostWish(ghost="8-6", color=(1.0, 0.2, 0.1)),)
    session = _Session(project.replace(coating=AsLens(), design=Design(wishes=wishes)))
    solver = Solver(session)
    solver.start_colors("quarter-wave", 30.0)
    solver._thread.join(60.0)
    assert solver.progress.words == "Coatings were found"
    (found,) = solver.progress.found
    worn = found.changes["coating"].coatings
    # rows 1 and 7 are cemented, row 5 is the stop
    assert [k for k, coating in enumerate(worn) if coating is None] == [1, 5, 7]
    said = found.words.split("; ")
    problem, lens = color_problem(session.project, "quarter-wave")
    rows = tuple(
        row.replace(coating=coating) if isinstance(row, Surface) else row
        for row, coating in zip(lens.rows, worn, strict=True)
    )
    colors = own_colors(lens.replace(rows=rows), problem.structure)
    off = perceived_differences(problem, colors)
    wished = problem.structure.pairs.index((8, 6))
    assert said[0].startswith("Wished colours: ")
    assert ("met" in said[0].split()) == (off[wished] < 0.02)
    others = np.delete(off, wished)
    assert said[1].startswith("the other ghosts: changed, ghost ")
    assert said[1].endswith(f" is farthest off, by {others.max():.2g}")
    assert said[-1] == "the cemented rows (1, 7) stay bare, for no film can be put there"


@pytest.mark.usefixtures("few_descents")
@pytest.mark.parametrize(("chosen", "look"), [(None, "srgb"), (9.0, "filmic")])
def test_coatings_are_shown_as_they_will_be_once_they_are_taken(project, chosen, look, monkeypatch):
    """At an exposure of their own they had looked brighter than the picture was with them."""
    # so large that the codec changes less than a draft does
    monkeypatch.setattr(studio, "WIDEST", max(studio.WIDEST, 480))
    monkeypatch.setattr(studio, "HIGHEST", max(studio.HIGHEST, 270))
    shot = project.replace(design=Design(wishes=(GhostWish(ghost="8-6", color=(1.0, 0.2, 0.1)),)))
    view = View(exposure_stops=chosen, look=look)
    told = []
    session = _Session(shot)
    session.tell = lambda event: told.append((event["type"], solver.progress.running, len(solver.progress.found)))
    solver = Solver(session, lambda: Seeing(view, 7.0))
    solver.start_colors("quarter-wave", 5.0)
    # what is moved meanwhile is moved in their pictures too
    shot = session.project = shot.replace(lights=(Light(field_deg=(-4.0, 2.0)),))
    solver._thread.join(60.0)
    # first by matrices, then by traced rays, as the picture will be
    assert solver._tracing.wait(60.0)
    (found,) = solver.progress.found
    picture = studio.take(found.taken(shot), "soon", View(), scale=solving.THUMB_SCALE)
    assert abs(studio.exposure_of(picture) - 7.0) > 0.5
    shown = np.asarray(Image.open(io.BytesIO(found.picture)), dtype=float)

    def off(other):
        pixels = pixels_of(studio.light_of(other, draft_match.Match()), chosen or 7.0, View(look=look))
        return np.abs(shown - pixels).mean()

    assert off(picture) < 1.5
    assert off(studio.take(found.taken(shot), "draft", View(), scale=solving.THUMB_SCALE)) > 2.0 * off(picture)
    assert told[-2:] == [("solve", False, 1)] * 2


def test_a_search_for_colours_is_stopped_at_once(project):
    """With many rows it takes minutes, and Stop had waited for them."""
    wishes = (GhostWish(ghost="1-0", color=(1.0, 0.2, 0.1)),)
    shot = project.replace(lens="canon-28-80", coating=AsLens(), design=Design(wishes=wishes))
    solver = Solver(_Session(shot))
    solver.start_colors("film", 600.0)
    assert solver.progress.running
    begun = time.perf_counter()
    solver.stop()
    assert time.perf_counter() - begun < 15.0
    assert not solver._thread.is_alive()
    assert len(solver.progress.found) == 1


def test_from_scratch_is_judged_by_traced_rays(project, monkeypatch):
    """Far off the axis matrices called lenses "met" whose ghosts no ray ever made."""
    names = ["wish 0", "wish 1"]
    asked = []

    def found(state, problem, *, name, **_):
        asked.append(problem.traced)
        return (
            SimpleNamespace(
                lens=as_lens(project.lens), residuals=np.zeros((2, 2)), breaks=(), lost=(names[1],),
            ),
        )  # fmt: skip

    monkeypatch.setattr(solving, "compile_kernels", lambda picture: None)
    monkeypatch.setattr(solving, "solve", lambda *_, **__: SimpleNamespace(searches=3, seconds=0.1))
    monkeypatch.setattr(solving, "outcomes", found)
    wishes = (GhostWish(place_mm=5.0, radius_mm=1.5), GhostWish(place_mm=-6.0, radius_mm=2.5))
    solver = Solver(_Session(project.replace(design=Design(wishes=wishes, own_ghosts=False))))
    solver.start(0.1)
    solver._thread.join(60.0)
    assert asked == [True]
    (one,) = solver.progress.found
    assert "; not met; too few rays make added ghost 2" in one.words
    # what is wished of a lens' own ghosts is told as the target is drawn
    wishes = (GhostWish(ghost="8-6", move_mm=1.0),)
    names[:] = ["8-6", "wish 0"]
    solver.session.project = project.replace(design=Design(wishes=wishes))
    solver.start(0.1)
    solver._thread.join(60.0)
    assert asked == [True, False]


def test_a_lens_that_stays_black_says_so(project, monkeypatch):
    """Its thumbnail had been black, and nothing had told why."""
    drafted = solving._found(project, {"lens": as_lens("tessar-brendel"), "coating": AsLens()}, "Lens 1", Seeing())
    monkeypatch.setattr(solving, "is_dark", lambda picture: picture.grade == "soon")
    traced = solving._drawn(drafted, project, Seeing(), "soon", lambda: None)
    assert traced.picture == drafted.picture
    assert traced.words == f"Lens 1; {solving.UNSEEN}"
