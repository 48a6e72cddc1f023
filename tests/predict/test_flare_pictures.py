"""Pictures of predictions by other processes: the same curves, plans and positions, and no picture twice."""

import json
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from painted import painted
from singlet_file import singlet_file

from flarewright.cli.app import run
from flarewright.errors import FlarewrightError
from flarewright.model import Light, Project
from flarewright.model.project.scene import Scene
from flarewright.predict.curves import sample_curves
from flarewright.predict.flare import Frame
from flarewright.predict.lens_flare import lens_flare, square_flare, statistics_quality
from flarewright.predict.occurrence import Flares, Wanted, predict_occurrence
from flarewright.predict.pictures import draw_all, in_colour
from flarewright.predict.plan import plan_scene
from flarewright.predict.search import best_position
from flarewright.predict.table import FlareTable
from flarewright.workflow.flare_pictures import pictures_elsewhere

FRAME = Frame(36.0, 24.0)
elsewhere = import_module("flarewright.workflow.flare_pictures")


class Others:
    """Other processes that finish pictures in another order, and can fail after some."""

    def __init__(self, most=None):
        self.lists, self.most = [], most

    def __call__(self, requests):
        if requests:
            self.lists.append([request.at for request in requests])
        for request in reversed(requests):
            if self.most is not None and sum(map(len, self.lists)) > self.most:
                raise KeyboardInterrupt
            yield request, request.draw()


def counted():
    """Return a painted flare, and the list of its pictures as they are drawn."""
    flare, drawn = replace(painted(64, peak_deg=21.0), fingerprint="painted"), []
    return replace(flare, draw=lambda *at: drawn.append(at) or flare.draw(*at)), drawn


def test_curves_that_are_drawn_ahead_are_those_of_one_process():
    flare, alone = counted()
    one = sample_curves(FlareTable(flare, FRAME), tolerance=0.02, most=40)
    ahead, drawn = counted()
    others = Others()
    found = sample_curves(FlareTable(ahead, FRAME), tolerance=0.02, most=40, spread=others)
    assert np.array_equal(found.constellation_deg, one.constellation_deg)
    assert np.array_equal(found.values, one.values)
    assert found.worst_step == one.worst_step
    # several at a time, none twice, and hardly more than are needed
    assert len(set(drawn)) == len(drawn) <= len(alone) + 12
    assert len(others.lists) <= len(alone) / 4
    assert len(others.lists[0]) == 13


def scene():
    places = [{"at_s": 8.0, "position_m": (-4.0, 10.0, 1.0)}]
    lamps = [
        {"kind": "lamp", "name": "a", "position_m": (4.0, 10.0, 0.0), "intensity_cd": 2000.0, "keyframes": places},
        {"kind": "lamp", "name": "b", "position_m": (1.0, 10.0, 0.0), "intensity_cd": 100.0},
    ]
    cameras = [
        {"name": name, "lens": "heliar-tronnier", "position_m": (x, 0.0, 0.0), "aim_m": (0.0, 10.0, 0.0)}
        for name, x in (("A", 0.0), ("B", 2.0))
    ]
    return Scene.model_validate({"cameras": cameras, "lights": lamps, "time": {"duration_s": 8.0, "step_s": 2.0}})


def planned(flare, memory, spread=None):
    return plan_scene(scene(), lambda *_: (flare, FRAME), lambda _: lambda *_: None, memory, spread)


def test_plans_and_positions_do_not_depend_on_who_draws():
    flare, alone = counted()
    plan, memory, others = planned(flare, {}), {}, Others()
    ahead, drawn = counted()
    found = planned(ahead, memory, others)
    assert [at for one in others.lists for at in one] == list(dict.fromkeys(alone))
    for c in range(2):
        assert np.array_equal(found.veil(c), plan.veil(c))
    near, expected = best_position(found, 1, 3.0, spread=others), best_position(plan, 1, 3.0)
    assert np.array_equal(near.veils_cd_m2, expected.veils_cd_m2)
    assert near.best == expected.best
    assert len(set(drawn)) == len(drawn) == len(alone)
    # one list for the plan, and at most one for each round of positions
    assert len(others.lists) <= 6
    # nothing is missing for the next one
    assert len(list(draw_all([found.tables[0][0].request(*at) for at in drawn], Others(0)))) == len(drawn)


def test_pictures_before_an_interruption_are_kept():
    flare, drawn = counted()
    memory = {}
    with pytest.raises(KeyboardInterrupt):
        planned(flare, memory, Others(0))
    assert drawn == []

    def broken(requests):
        for k, request in enumerate(requests):
            if k == 3:
                raise FlarewrightError("the connection with the cluster is lost")
            yield request, request.draw()

    with pytest.raises(FlarewrightError, match="is lost"):
        planned(flare, memory, broken)
    assert set(memory["painted"]) == set(drawn)
    others = Others()
    planned(flare, memory, others)
    assert not {at for one in others.lists for at in one} & set(drawn[:3])
    assert len(set(drawn)) == len(drawn)


def singlet(folder):
    light = Light(field_deg=(0.0, 0.0))
    return Project(
        lens=singlet_file(folder), f_number=8, lights=(light,), camera={"size_px": (48, 32)}, quality={"mode": "draft"}
    )


def test_a_process_makes_the_same_flare_again(tmp_path, monkeypatch):
    project = singlet(tmp_path)
    flare, frame = square_flare(project, statistics_quality("draft"))
    shown = lens_flare(project)
    table, memory, made = FlareTable(flare, frame), {}, {}
    monkeypatch.setattr(elsewhere, "_flares", made)
    requests = [table.request(5.0, 0.0), table.request(9.0, 0.0), in_colour(shown, memory, 5.0, 30.0)]
    expected = [request.draw() for request in requests]
    one = list(elsewhere._spread(None, 1, 1, requests))
    assert [request for request, _ in one] == requests
    for (_, picture), same in zip(one, expected, strict=True):
        assert picture.dtype == same.dtype
        assert np.array_equal(picture, same)
    assert set(made) == {flare.fingerprint, shown.fingerprint}
    # without a recipe it is drawn here
    made.clear()
    ((_, here),) = elsewhere._spread(None, 1, 1, [FlareTable(replace(flare, recipe=None), frame).request(5.0, 0.0)])
    assert np.array_equal(here, expected[0])
    assert made == {}


def test_another_lens_on_a_worker_is_one_sentence(tmp_path):
    flare, frame = square_flare(singlet(tmp_path), statistics_quality("draft"))
    request = FlareTable(replace(flare, fingerprint="of another machine"), frame).request(5.0, 0.0)
    with pytest.raises(FlarewrightError, match="a worker reads another Singlet than this command; give all machines"):
        list(elsewhere._spread(None, 1, 1, [request]))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--cluster farm", "cluster 'farm' is unknown"),
        ("--cluster local:2 --processes 2", "--processes 2 and --cluster local:2 both set the processes; keep one"),
        ("--cluster tcp://a:1 --threads 2", "--threads has no effect on --cluster tcp://a:1"),
        ("--cluster slurm:none.toml", "none.toml does not exist"),
    ],
)
def test_a_cluster_that_cannot_draw_predictions_is_one_sentence(capsys, words, said):
    assert run(["predict", "heliar-tronnier", *words.split()]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert len(err.strip().splitlines()) == 1


# ---------------------------------------------------------------------------------------------------------------------
# With other processes: seconds for their start

SCENE = """
name = "Two lamps"
cameras = [{{ name = "A", lens = '{lens}', f_number = 8.0, position_m = [0, 0, 0], aim_m = [0, 10, 0] }}]
lights = [
  {{ kind = "lamp", name = "a", position_m = [4, 10, 0], intensity_cd = 2e3 }},
  {{ kind = "lamp", name = "b", position_m = [1, 10, 3], intensity_cd = 1e2 }},
]
"""


@pytest.mark.slow
@pytest.mark.parametrize("how", ["--processes 2", "--cluster local:2"])
def test_other_processes_give_the_report_of_one(tmp_path, monkeypatch, capsys, how):
    if "cluster" in how:
        pytest.importorskip("distributed", reason="needs the extra cluster")
    monkeypatch.chdir(tmp_path)
    # a name from the working folder
    lens = "singlet.toml"
    singlet_file(tmp_path)
    (tmp_path / "s.toml").write_text(SCENE.format(lens=lens))
    for subject in (("s.toml", "--near", "A", "--radius", "2"), (lens, "--fstop", "8", "--samples", "14")):
        pages, printed = [], []
        for words in ("", how):
            assert run(["predict", *subject, "--quality", "draft", "--json", "-o", "p.html", *words.split()]) == 0
            pages.append((tmp_path / "p.html").read_bytes())
            printed.append(json.loads(capsys.readouterr().out))
        assert pages[0] == pages[1]
        assert printed[0] == printed[1]
    assert {path.name for path in tmp_path.iterdir()} == {"p.html", "s.toml", "singlet.toml"}


@pytest.mark.slow
def test_a_cluster_that_is_not_there_is_one_sentence(tmp_path):
    pytest.importorskip("distributed", reason="needs the extra cluster")
    with (
        pytest.raises(FlarewrightError, match=r"^no Dask scheduler answers at tcp://127\.0\.0\.1:1"),
        pictures_elsewhere("tcp://127.0.0.1:1", None, None, tmp_path),
    ):
        pass


@pytest.mark.slow
def test_curves_of_a_local_cluster_have_the_numbers_of_one_process(tmp_path):
    pytest.importorskip("distributed", reason="needs the extra cluster")
    project = singlet(tmp_path)
    flare, frame = square_flare(project, statistics_quality("final"))
    flares = Flares(flare, frame, "final", None, lens_flare(project))
    wanted = Wanted(to_deg=30.0, samples=20, tolerance=1e-3)
    one = predict_occurrence(flares, wanted, lambda _: lambda *_: None)
    with pictures_elsewhere("local:2", None, None, tmp_path) as spread:
        many = predict_occurrence(flares, wanted, lambda _: lambda *_: None, spread=spread)
    assert np.array_equal(many.curves.values, one.curves.values)
