"""Messages of a search in the editor; the search itself is tested in tests/design and in the browser."""

import io
import threading
import time
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from flarewright.design.coatings.color_search import solve_colors
from flarewright.design.coatings.colors import color_problem, own_colors, perceived_differences
from flarewright.design.solvers import pool_search
from flarewright.design.solvers.pool_search import PoolState, solve
from flarewright.editor.design import search_job
from flarewright.editor.design.kept_search import kept_search, read_kept
from flarewright.editor.design.search_job import DisplaySettings, Solver
from flarewright.editor.preview import draft_match, render_picture
from flarewright.editor.preview.display_image import pixels_of
from flarewright.editor.session.view_settings import View
from flarewright.errors import ProjectError
from flarewright.model import AsLens, Design, Everywhere, GhostTarget, Light, Preset, QuarterWave, Surface
from flarewright.optics.rays.pack import resolve_coatings
from flarewright.render.scene.resolve import open_lens


@pytest.fixture
def project(project, screen_size):
    """Return the project, simplified for the size of the screen."""
    return screen_size(project)


@pytest.fixture
def few_descents(screen_size, monkeypatch):
    """Run an eighth of the descents of a colour search on a small screen."""
    if render_picture.WIDEST < 960:
        monkeypatch.setattr(search_job, "solve_colors", partial(solve_colors, starts=8))


class _Session:
    def __init__(self, project):
        self.project = project

    def tell(self, event):
        pass


@pytest.mark.parametrize("possible", [True, False])
def test_impossible_targets_are_reported(project, monkeypatch, possible):
    monkeypatch.setattr(search_job, "compile_kernels", lambda picture: None)
    monkeypatch.setattr(search_job, "solve", lambda *_, **__: SimpleNamespace(searches=3, seconds=0.1))
    monkeypatch.setattr(search_job, "outcomes", lambda *_, **__: ())
    ghost_target = (
        GhostTarget(place_mm=1.0, radius_mm=1.0) if possible else GhostTarget(at_mm=(0.0, 5.0), radius_mm=1.0)
    )
    design = Design(ghost_targets=(ghost_target,), own_ghosts=False)
    solver = Solver(_Session(project.replace(lights=(Light(field_deg=(5.0, 0.0)),), design=design)))
    solver.start(0.1)
    solver._thread.join(60.0)
    assert not solver.progress.running
    assert solver.progress.words.startswith("No lens was found" if possible else "No lens can do that: added ghost 1")


def test_a_search_that_gets_ready_is_stopped_at_once(project, monkeypatch):
    """The first search on a computer compiles for a minute without a check: Stop used to wait for it."""
    compiled, searched = threading.Event(), []
    monkeypatch.setattr(search_job, "compile_kernels", lambda picture: compiled.wait(60.0))
    monkeypatch.setattr(
        search_job, "solve", lambda *_, **__: searched.append(1) or SimpleNamespace(searches=1, seconds=0)
    )
    monkeypatch.setattr(search_job, "outcomes", lambda *_, **__: ())
    design = Design(ghost_targets=(GhostTarget(place_mm=1.0, radius_mm=1.0),), own_ghosts=False)
    solver = Solver(_Session(project.replace(lights=(Light(field_deg=(5.0, 0.0)),), design=design)))
    solver.start(0.1)
    first = solver._thread
    started = time.perf_counter()
    solver.stop()
    assert time.perf_counter() - started < 5.0
    assert not solver.progress.running
    assert solver.progress.words.startswith("Stopped")
    # the next search may start meanwhile, and the stopped one reports nothing any more
    solver.start(0.1)
    compiled.set()
    first.join(60.0)
    solver._thread.join(60.0)
    assert searched == [1]
    assert solver.progress.words.startswith("No lens was found")


def test_a_search_of_an_ended_editor_resumes(project, monkeypatch):
    """Its end is that of a search without interruption: the same rounds, whatever the number of editors."""
    rounds = 3
    monkeypatch.setattr(pool_search, "batch_size", lambda _: 4)
    monkeypatch.setattr(search_job, "compile_kernels", lambda picture: None)
    monkeypatch.setattr(search_job, "outcomes", lambda *_, **__: ())
    monkeypatch.setattr(search_job, "obstacles", lambda *_, **__: ())
    monkeypatch.setattr(search_job, "KEEP_EVERY_S", 0.0)
    ghost_target = GhostTarget(ghost="4-1", move_mm=2.0, color=(1.0, 0.4, 0.1))
    project = project.replace(lens="heliar-tronnier", design=Design(ghost_targets=(ghost_target,)))
    states: list[PoolState] = []

    def facts(state):
        found = [(one.cost, one.structure, one.x.tobytes()) for run in state.runs for one in run.members]
        return state.seed, state.next_run, state.searches, found

    def searched(leave_after):
        """Search until the end after three rounds, or until the editor ends."""
        solver = Solver(_Session(project))

        def through(problem, *, progress, cancelled, state, **_):
            def note(now):
                progress(now)
                if len(states) == leave_after:
                    solver.close()

            while len(states) < rounds and not cancelled():
                # without a time limit that depends on the machine
                state = solve(problem, most_searches=state.searches + 1, state=state)
                states.append(state)
                note(state)
            return state

        monkeypatch.setattr(search_job, "solve", through)
        solver.start(60.0)
        solver._thread.join(60.0)

    file = kept_search(project)
    searched(leave_after=0)
    whole = [facts(state) for state in states]
    assert not file.exists()
    states.clear()
    searched(leave_after=2)
    assert len(states) == 2
    kept = read_kept(file)
    assert facts(kept) == facts(states[-1])
    assert kept.seconds == states[-1].seconds
    searched(leave_after=0)
    assert [facts(state) for state in states] == whole
    assert not file.exists()
    file.write_text("{")
    assert read_kept(file) is None


def test_lenses_are_described_and_the_best_comes_first(project, monkeypatch):
    """Lenses are sorted by the error in their description, the largest one."""

    def found(state, problem, *, name, **_):
        names = problem.objective.names
        at = {one: np.zeros((len(names), 2)) for one in ("far", "near", "met")}
        at["far"][names.index("target 1")] = 0.1, -2.0
        at["near"][names.index("8-6")] = 0.25, 0.1
        # its sum of errors is larger than that of the previous lens
        at["near"] += 0.2
        whole = open_lens(project.lens).lens
        return tuple(
            SimpleNamespace(lens=whole.replace(name=f"{name} 7"), residuals=at[one], breaks=(), lost=())
            for one in ("far", "met", "near")
        )

    monkeypatch.setattr(search_job, "compile_kernels", lambda picture: None)
    monkeypatch.setattr(search_job, "solve", lambda *_, **__: SimpleNamespace(searches=3, seconds=0.1))
    monkeypatch.setattr(search_job, "outcomes", found)
    ghost_targets = (GhostTarget(ghost="8-6", move_mm=1.0), GhostTarget(place_mm=1.0, radius_mm=1.0))
    solver = Solver(_Session(project.replace(design=Design(ghost_targets=ghost_targets))))
    solver.start(0.1)
    solver._thread.join(60.0)
    words = [one.words for one in solver.progress.found]
    assert [one.partition("; ")[0] for one in words] == [f"Lens {k}: 8 surfaces, 99.2 mm f/3.5" for k in (1, 2, 3)]
    assert words[0].endswith("; met")
    assert words[1].endswith("; not met, ghost 8-6 is farthest off, by 0.45 mm")
    assert words[2].endswith("; not met, added ghost 1 is farthest off, by 2 mm")
    assert [one.changes["lens"].name[-1] for one in solver.progress.found] == ["1", "2", "3"]

    # corresponding rows have the same coatings
    worn = resolve_coatings(open_lens(project.lens).lens, project.coating)
    assert any(worn)
    session = solver.session
    puts = []
    session.put = lambda found, label: puts.append(found)
    # the found sizes need another f-number, which the message reports
    assert solver.accept(0) == (
        "“After Heliar-Tronnier 100 mm f/3.5 1” was accepted; its f-number is f/3.5 instead of f/8, as its ghosts "
        "have the found sizes at that opening. The targets are removed. Undo restores everything."
    )
    assert puts[0].f_number is None
    assert resolve_coatings(puts[0].lens, puts[0].coating) == tuple(worn)
    # after one result is accepted another one may be; for another lens they are outdated
    session.project = puts[0]
    assert solver.accept(1).endswith("2” was accepted. Undo restores everything.")
    session.project = project.replace(lens="tessar-brendel")
    assert solver.fitting.found == ()
    with pytest.raises(ProjectError, match="another lens"):
        solver.accept(0)
    session.project = project
    assert len(solver.fitting.found) == 3


@pytest.mark.parametrize("coating", [AsLens(), Everywhere(coating=QuarterWave(center_wavelength_nm=550.0))])
def test_a_lens_of_other_rows_wears_what_fits_all(project, coating):
    assert search_job._coatings_for(project.replace(coating=coating), open_lens("canon-28-80").lens) == coating


def test_a_lens_of_other_rows_does_not_wear_those_of_the_one_before(project):
    assert project.coating == Preset(name="thesis")
    assert search_job._coatings_for(project, open_lens("canon-28-80").lens) is None


def test_a_colour_for_a_new_ghost_is_refused_in_the_pages_words(project):
    ghost_targets = (GhostTarget(ghost="8-6", color=(1.0, 0.2, 0.1)), GhostTarget(place_mm=1.0, radius_mm=1.0))
    solver = Solver(_Session(project.replace(design=Design(ghost_targets=ghost_targets))))
    with pytest.raises(ProjectError, match=r"^added ghost 1 is for a new ghost; colours are for"):
        solver.start_colors("quarter-wave", 30.0)


@pytest.mark.usefixtures("few_descents")
def test_colours_that_are_found_keep_the_shot_as_it_is(project):
    """Only coatings change: f-number, glass and changes made meanwhile stay."""
    puts = []
    session = _Session(project.replace(design=Design(ghost_targets=(GhostTarget(ghost="8-6", color=(1.0, 0.2, 0.1)),))))
    session.put = lambda found, label: puts.append(found)
    solver = Solver(session)
    solver.start_colors("quarter-wave", 30.0)
    solver._thread.join(60.0)
    assert len(solver.progress.found) == 1
    session.project = session.project.replace(lights=(Light(field_deg=(5.0, 0.0)),))
    assert solver.accept(0).startswith("The coatings were accepted; lens, f-number and zoom are unchanged. ")
    (found,) = puts
    assert found.coating.kind == "per-row"
    assert found.design is None
    assert found == session.project.replace(coating=found.coating, design=None)


@pytest.mark.usefixtures("few_descents")
def test_colour_errors_are_described_and_cemented_rows_stay_bare(project):
    ghost_targets = (GhostTarget(ghost="8-6", color=(1.0, 0.2, 0.1)),)
    session = _Session(project.replace(coating=AsLens(), design=Design(ghost_targets=ghost_targets)))
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
    wanted = problem.structure.pairs.index((8, 6))
    assert said[0].startswith("Target colours: ")
    assert ("met" in said[0].split()) == (off[wanted] < 0.02)
    others = np.delete(off, wanted)
    assert said[1].startswith("the other ghosts: changed, ghost ")
    assert said[1].endswith(f" is farthest off, by {others.max():.2g}")
    assert said[-1] == "the cemented rows (1, 7) stay bare, as cemented surfaces take no film"


@pytest.mark.usefixtures("few_descents")
@pytest.mark.parametrize(("chosen", "look"), [(None, "srgb"), (9.0, "filmic")])
def test_coatings_are_shown_as_they_will_be_once_they_are_taken(project, chosen, look, monkeypatch):
    """With a separate exposure they used to look brighter than the picture afterwards."""
    # so large that the codec changes less than a draft does
    monkeypatch.setattr(render_picture, "WIDEST", max(render_picture.WIDEST, 480))
    monkeypatch.setattr(render_picture, "HIGHEST", max(render_picture.HIGHEST, 270))
    shot = project.replace(design=Design(ghost_targets=(GhostTarget(ghost="8-6", color=(1.0, 0.2, 0.1)),)))
    # a draft differs by its other ghosts
    shot = shot.replace(quality=shot.quality.replace(paths="all"))
    view = View(exposure_stops=chosen, look=look)
    reported = []
    session = _Session(shot)
    session.tell = lambda event: reported.append((event["type"], solver.progress.running, len(solver.progress.found)))
    solver = Solver(session, lambda: DisplaySettings(view, 7.0))
    solver.start_colors("quarter-wave", 5.0)
    # a light moved meanwhile is moved in their pictures too
    shot = session.project = shot.replace(lights=(Light(field_deg=(-4.0, 2.0)),))
    solver._thread.join(60.0)
    # first by matrices, then by traced rays, as the picture will be
    assert solver._tracing.wait(60.0)
    (found,) = solver.progress.found
    picture = render_picture.take(found.taken(shot), "soon", View(), scale=search_job.THUMB_SCALE)
    assert abs(render_picture.exposure_of(picture) - 7.0) > 0.5
    shown = np.asarray(Image.open(io.BytesIO(found.picture)), dtype=float)

    def off(other):
        pixels = pixels_of(render_picture.chosen_light(other, draft_match.Match()), chosen or 7.0, View(look=look))
        return np.abs(shown - pixels).mean()

    assert off(picture) < 1.5
    assert off(render_picture.take(found.taken(shot), "draft", View(), scale=search_job.THUMB_SCALE)) > 2.0 * off(
        picture
    )
    assert reported[-2:] == [("solve", False, 1)] * 2


def test_a_search_for_colours_is_stopped_at_once(project):
    """With many rows it takes minutes, and Stop used to wait."""
    ghost_targets = (GhostTarget(ghost="1-0", color=(1.0, 0.2, 0.1)),)
    shot = project.replace(lens="canon-28-80", coating=AsLens(), design=Design(ghost_targets=ghost_targets))
    solver = Solver(_Session(shot))
    solver.start_colors("film", 600.0)
    assert solver.progress.running
    started = time.perf_counter()
    solver.stop()
    assert time.perf_counter() - started < 15.0
    assert not solver._thread.is_alive()
    assert len(solver.progress.found) == 1


def test_from_scratch_is_judged_by_traced_rays(project, monkeypatch):
    """Far off the axis, matrices used to call lenses "met" whose ghosts no ray makes."""
    names = ["target 0", "target 1"]
    asked = []

    def found(state, problem, *, name, **_):
        asked.append(problem.traced)
        return (
            SimpleNamespace(
                lens=open_lens(project.lens).lens, residuals=np.zeros((2, 2)), breaks=(), lost=(names[1],),
            ),
        )  # fmt: skip

    monkeypatch.setattr(search_job, "compile_kernels", lambda picture: None)
    monkeypatch.setattr(search_job, "solve", lambda *_, **__: SimpleNamespace(searches=3, seconds=0.1))
    monkeypatch.setattr(search_job, "outcomes", found)
    ghost_targets = (GhostTarget(place_mm=5.0, radius_mm=1.5), GhostTarget(place_mm=-6.0, radius_mm=2.5))
    solver = Solver(_Session(project.replace(design=Design(ghost_targets=ghost_targets, own_ghosts=False))))
    solver.start(0.1)
    solver._thread.join(60.0)
    assert asked == [True]
    (one,) = solver.progress.found
    assert "; not met; too few rays reach added ghost 2" in one.words
    # targets of a lens' own ghosts are reported as they are drawn
    ghost_targets = (GhostTarget(ghost="8-6", move_mm=1.0),)
    names[:] = ["8-6", "target 0"]
    solver.session.project = project.replace(design=Design(ghost_targets=ghost_targets))
    solver.start(0.1)
    solver._thread.join(60.0)
    assert asked == [True, False]


def test_a_lens_that_stays_black_says_so(project, monkeypatch):
    """Its thumbnail used to be black without an explanation."""
    drafted = search_job._found(
        project, {"lens": open_lens("tessar-brendel").lens, "coating": AsLens()}, "Lens 1", DisplaySettings()
    )
    monkeypatch.setattr(search_job, "has_no_ghosts", lambda picture: picture.grade == "soon")
    traced = search_job._drawn(drafted, project, DisplaySettings(), "soon", lambda: None)
    assert traced.picture == drafted.picture
    assert traced.words == f"Lens 1; {search_job.UNSEEN}"
