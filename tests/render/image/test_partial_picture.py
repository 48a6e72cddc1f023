"""A final render that was interrupted resumes to the pixels of one that was not."""

from functools import cache
from shutil import copytree
from threading import Event

import numpy as np
import pytest

from flarewright.model import Art, Camera, Iris, Light, Output, Project, Quality, Rule
from flarewright.render.image import partial_picture
from flarewright.render.image.canvas import blank
from flarewright.render.image.partial_picture import KeptSteps, PartialPicture, digest_of
from flarewright.render.reference import four_reflections
from flarewright.render.render import render

POINTS = (Light(field_deg=(9.0, 4.0)), Light(field_deg=(-5.0, 2.0)))
# few ghosts; rings only in the case "points"
PROJECT = Project(
    lens="triplet-pestrecov", lights=POINTS, f_number=8.0, iris=Iris(blades=6), camera=Camera(size_px=(64, 36)),
    quality=Quality(wavelengths=1, ringing="off"), output=Output(starburst=False),
)  # fmt: skip
FOURS = PROJECT.replace(
    quality=Quality(wavelengths=1, ringing="off", orders=4, order4_limit=5e-3),
    lights=POINTS[:1],
    camera=Camera(size_px=(32, 18)),
)
CASES = {
    "points": PROJECT.replace(quality=Quality(wavelengths=2, paths="same-side")),
    "disc": PROJECT.replace(lights=(Light(field_deg=(9.0, 4.0), diameter_deg=0.5), POINTS[1])),
    "layers": PROJECT.replace(output=Output(layers="ghosts", brightest=3, starburst=False)),
    "art": PROJECT.replace(art=Art(rules=(Rule(select="all", blur_mm=0.3), Rule(select="2-1", blur_mm=0.2)))),
    "four reflections": FOURS,
}


def write_every_step(patch):
    patch.setattr(partial_picture, "CHECKPOINT_S", 0.0)
    patch.setattr(partial_picture, "WRITING", np.inf)


@pytest.fixture(autouse=True)
def often(monkeypatch):
    """Write after every step."""
    write_every_step(monkeypatch)


class Interrupting(PartialPicture):
    """A partial picture whose render is interrupted right after a number of writes."""

    def __init__(self, folder, after):
        super().__init__(folder, print)
        self.after = after

    def store(self, *given):
        written = super().store(*given)
        self.after -= 1
        if self.after == 0:
            raise KeyboardInterrupt
        return written


def interrupted(project, folder, after):
    """Render until a number of steps is written, as Ctrl-C or a killed process would."""
    with pytest.raises(KeyboardInterrupt):
        render(project, kept=Interrupting(folder, after), threads=2)
    assert list(folder.glob("*.npz"))


@cache
def whole():
    """Return the layers of the project's render that nothing interrupts."""
    return render(PROJECT).layers


@pytest.fixture(scope="module")
def part(tmp_path_factory):
    """Return a folder with a part of the project's picture."""
    folder = tmp_path_factory.mktemp("part") / "out"
    with pytest.MonkeyPatch.context() as patch:
        write_every_step(patch)
        interrupted(PROJECT, folder, 10)
    return folder


def resumed(project, folder, threads=1):
    """Return the layers of the resumed render, and what it reports."""
    said = []
    kept = PartialPicture(folder, said.append)
    found = render(project, kept=kept, threads=threads).layers
    kept.remove()
    return found, said


def same(ours, theirs):
    return [layer.name for layer in ours] == [layer.name for layer in theirs] and all(
        np.array_equal(a.pixels, b.pixels) for a, b in zip(ours, theirs, strict=True)
    )


@pytest.mark.parametrize("case", CASES)
def test_an_interrupted_render_resumes_to_the_same_pixels(case, tmp_path):
    folder = tmp_path / "out.partial"
    # all ghosts of a blur are one step of a canvas
    interrupted(CASES[case], folder, 1 if case == "art" else 6)
    found, said = resumed(CASES[case], folder)
    assert same(found, render(CASES[case]).layers)
    assert said == [f"{folder}: resuming an interrupted run"]
    assert not folder.exists()


def test_an_interrupted_search_for_four_reflections_resumes(tmp_path, monkeypatch):
    class InSearch(PartialPicture):
        """A partial picture whose render is interrupted after two batches beyond the pilot."""

        written = 0

        def store_arrays(self, *given):
            self.written += super().store_arrays(*given)
            if self.written == 2:
                raise KeyboardInterrupt
            return True

    batches, trace = [], four_reflections.run_batch

    def counted(sources, k, **more):
        batches.append(k)
        return trace(sources, k, **more)

    monkeypatch.setattr(four_reflections, "run_batch", counted)
    folder = tmp_path / "out.partial"
    with pytest.raises(KeyboardInterrupt):
        render(FOURS, kept=InSearch(folder, print), threads=2)
    batches.clear()
    found, said = resumed(FOURS, folder)
    # those of the interrupted run are not traced again
    assert min(batches) == four_reflections.PILOT + 2
    assert said == [f"{folder}: resuming an interrupted run"]
    monkeypatch.undo()
    assert same(found, render(FOURS).layers)


def test_a_resumed_render_draws_only_the_other_ghosts(tmp_path, monkeypatch):
    from flarewright.render.ghosts import final_ghosts

    drawn, draw = [], final_ghosts.draw_final
    monkeypatch.setattr(
        final_ghosts, "draw_final", lambda item, *a, **k: (drawn.append(item.path.name), draw(item, *a, **k))
    )
    render(PROJECT, kept=PartialPicture(tmp_path / "whole", print))
    every = len(drawn)
    interrupted(PROJECT, tmp_path / "out", 10)
    before = len(drawn) - every
    resumed(PROJECT, tmp_path / "out")
    assert before >= 10
    # every ghost once: the canvas of a cancelled picture is kept with the ghost in progress
    assert len(drawn) == 2 * every


@pytest.mark.parametrize(
    "other",
    [
        PROJECT.replace(f_number=5.6),
        PROJECT.replace(lights=(POINTS[0], Light(field_deg=(-5.0, 2.1)))),
        PROJECT.replace(lens="tessar-brendel", quality=Quality(wavelengths=1, ringing="off", paths="same-side")),
        PROJECT.replace(camera=Camera(size_px=(66, 36))),
        PROJECT.replace(quality=Quality(wavelengths=1, ringing="off", tolerance_px=0.5)),
        PROJECT.replace(art=Art(rules=(Rule(select="all", gain=2.0),))),
    ],
    ids=["f-number", "light", "lens", "size", "quality", "art"],
)
def test_a_part_of_other_settings_is_dropped(other, part, tmp_path):
    copytree(part, tmp_path / "out")
    found, said = resumed(other, tmp_path / "out")
    assert same(found, render(other).layers)
    assert len(said) == 1
    assert "belongs to other settings; it is drawn again" in said[0]


@pytest.mark.parametrize("harm", [lambda data: b"", lambda data: data[:300], lambda data: b"x" * len(data)])
def test_a_damaged_part_is_drawn_again(harm, part, tmp_path):
    copytree(part, tmp_path / "out")
    for path in (tmp_path / "out").glob("*.npz"):
        path.write_bytes(harm(path.read_bytes()))
    found, said = resumed(PROJECT, tmp_path / "out")
    assert same(found, whole())
    assert len(said) == 1
    assert said[0].endswith("it is drawn again")


def test_a_part_that_cannot_be_written_costs_one_sentence(tmp_path):
    (tmp_path / "out").write_text("a file of the user")
    found, said = resumed(PROJECT, tmp_path / "out")
    assert same(found, whole())
    assert len(said) == 1
    assert said[0].startswith("no checkpoint: ")
    assert (tmp_path / "out").read_text() == "a file of the user"


def test_a_short_render_writes_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(partial_picture, "CHECKPOINT_S", 600.0)
    kept = PartialPicture(tmp_path / "out", print)
    render(PROJECT, kept=kept)
    assert kept.size_bytes == 0
    assert list(tmp_path.iterdir()) == []


def test_a_step_that_was_cut_is_not_kept(tmp_path):
    kept, cancelled, canvas = PartialPicture(tmp_path / "out", print), Event(), blank((8, 8))
    kept.begin("two", 1)
    steps = KeptSteps(kept, "a", canvas, cancelled)

    def light(value, stop):
        canvas.plane()[...] += value
        if value > 1.0:
            cancelled.set()

    steps.step(lambda stop: light(1.0, stop))
    steps.step(lambda stop: light(2.0, stop), whole=False)
    steps.step(lambda stop: light(4.0, stop))
    steps.end()
    again = blank((8, 8))
    assert kept.load("a", again) == 1
    assert (again.plane() == 1.0).all()


def test_the_digest_depends_on_every_value_and_type():
    array = np.arange(4.0)
    values = [None, 0, 0.0, False, "0", b"0", (0,), ((0,),), {"a": 0}, array, array.reshape(2, 2), POINTS[0], POINTS[1]]
    assert len({digest_of(value) for value in values}) == len(values)
    assert digest_of(array, POINTS) == digest_of(array.copy(), tuple(POINTS))
    with pytest.raises(TypeError, match="a object has no digest"):
        digest_of(object())
