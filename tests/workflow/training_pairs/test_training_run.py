"""A data set: the same bytes whatever the processes, chunks and interruptions; items add up and can be drawn again."""

from __future__ import annotations

import io
import json
import tarfile
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flarewright import dataset, read_project, render
from flarewright.errors import FlarewrightError, OutputError, ProjectError
from flarewright.io.images.exr import read_exr
from flarewright.model.project.dataset import DatasetSpec
from flarewright.workflow.training_pairs import item, run
from flarewright.workflow.training_pairs.background import background_of, list_backgrounds, mean_luminance
from flarewright.workflow.training_pairs.pictures import draw_pictures

LENSES = ["heliar-tronnier", "triplet-pestrecov"]
ITEMS = 5


def spec_of(**changes):
    fields = {
        "size_px": (64, 48), "items_per_shard": 3, "lens": {"names": LENSES, "stops_down": 4.0},
        "lights": {"stops": 3.0}, "splits": {"train": 1, "test": 1},
        "sensor": {"full_well_e": 4000.0}, "masks": {"ghosts": 3},
    }  # fmt: skip
    return DatasetSpec.model_validate({**fields, **changes})


def contents(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(Path(folder).rglob("*.*"))}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole") / "pairs"
    result = dataset(spec_of(), folder, items=ITEMS, processes=1, threads=1)
    assert (result.drawn, result.kept, result.complete) == (ITEMS, 0, True)
    assert sum(result.splits.values()) == ITEMS
    return folder


@pytest.fixture(scope="module")
def linear(tmp_path_factory):
    """Return a folder of linear pictures without noise."""
    folder = tmp_path_factory.mktemp("linear") / "pairs"
    spec = spec_of(
        layout="folder", format="exr", light_in_clean="none", splits={"train": 1.0},
        sensor={"tone": "linear", "clip": False},
    )  # fmt: skip
    plain = DatasetSpec.model_validate({key: value for key, value in spec if key != "items_per_shard"})
    dataset(plain, folder, items=2, processes=1)
    return folder


def test_tar_files_hold_what_the_manifest_lists(whole):
    lines = [json.loads(line) for line in (whole / "manifest.jsonl").read_text().splitlines()]
    assert [line["index"] for line in lines] == list(range(ITEMS))
    found = {}
    for path in sorted(whole.glob("*.tar")):
        split, number = path.stem.split("-")
        with tarfile.open(path) as archive:
            names = archive.getnames()
            # the files of an item follow each other
            keys = list(dict.fromkeys(name.partition(".")[0] for name in names))
            assert names == sorted(names, key=lambda name: keys.index(name.partition(".")[0]))
            for name in names:
                found[name] = archive.extractfile(name).read()
        for key in keys:
            about = json.loads(found[f"{key}.json"])
            assert (about["split"], about["index"] // 3) == (split, int(number))
            assert about == lines[about["index"]]
    for line in lines:
        assert set(line["files"]) == {
            "clean", "flared", "ghosts", "starburst", "light_mask", "ghost_mask", "project"
        }  # fmt: skip
        for about in line["files"].values():
            assert sha256(found[about["file"]]).hexdigest() == about["sha256"]
    flared = np.asarray(Image.open(io.BytesIO(found["00000000.flared.png"])))
    assert flared.shape == (48, 64, 3)
    # a lens is in one split
    assert len({(line["lens"], line["split"]) for line in lines}) == len({line["lens"] for line in lines})


@pytest.mark.slow
def test_two_processes_make_the_bytes_of_one(whole, tmp_path):
    result = dataset(spec_of(), tmp_path / "pairs", items=ITEMS, processes=2)
    assert result.processes == 2
    assert contents(tmp_path / "pairs") == contents(whole)


def test_two_chunks_make_the_bytes_of_one_run(whole, tmp_path):
    folder = tmp_path / "pairs"
    second = dataset(spec_of(), folder, items=ITEMS, chunk="2/2", processes=1)
    assert not second.complete
    assert "3 of 5 items are not drawn yet" in second.remarks[0]
    assert not (folder / "manifest.jsonl").exists()
    first = dataset(spec_of(), folder, items=ITEMS, chunk="1/2", processes=1, threads=2)
    assert (first.drawn, first.complete) == (3, True)
    assert contents(folder) == contents(whole)


def test_an_interrupted_run_resumes_and_finished_items_are_kept(whole, tmp_path, monkeypatch):
    folder, drawn = tmp_path / "pairs", []

    def interrupt(result, done, of):
        drawn.append(result.index)
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        dataset(spec_of(), folder, items=ITEMS, processes=1, report=interrupt)
    assert len(list((folder / ".items").iterdir())) == 2
    # one of the two is damaged meanwhile
    part = folder / ".items" / "00000001.part"
    part.write_bytes(part.read_bytes()[:-600])
    again = dataset(spec_of(), folder, items=ITEMS, processes=1)
    assert (again.drawn, again.kept) == (ITEMS - 1, 1)
    assert contents(folder) == contents(whole)
    assert not (folder / ".items").exists()
    # killed after the tar files were complete, before the parts were removed
    (folder / ".items").mkdir()
    part.write_bytes(b"")
    monkeypatch.setattr(item, "draw_pictures", None)
    assert dataset(spec_of(), folder, items=ITEMS, processes=1).kept == ITEMS
    assert not (folder / ".items").exists()


def test_items_are_written_while_another_process_packs_the_last_ones_before(tmp_path, monkeypatch):
    """The folder of unfinished items must not vanish between its making and the file in it."""
    plan, make_folder = run.plan_of(spec_of(), tmp_path / "pairs"), item.make_folder
    plan.staging.mkdir(parents=True)

    def made_and_emptied(folder):
        make_folder(folder)
        run._remove_fragments(plan, range(3))

    monkeypatch.setattr(item, "make_folder", made_and_emptied)
    assert item.write_item(plan, 3).drawn
    assert [path.name for path in plan.staging.iterdir()] == ["00000003.part"]


def test_a_set_grows_but_never_mixes(whole, tmp_path, monkeypatch):
    folder = tmp_path / "pairs"
    dataset(spec_of(), folder, items=3, processes=1)
    with pytest.raises(OutputError, match="holds a data set of 3 items; give -n 3 or more"):
        dataset(spec_of(), folder, items=2, processes=1)
    with pytest.raises(OutputError, match="holds a data set of another specification; give another folder"):
        dataset(spec_of(seed=9), folder, items=3, processes=1)
    with monkeypatch.context() as other:
        other.setattr(run, "_DRAWN_AS", run._DRAWN_AS + 1)
        with pytest.raises(OutputError, match="another specification, or by another build of this version; give"):
            dataset(spec_of(), folder, items=3, processes=1)
    grown = dataset(spec_of(), folder, items=ITEMS, processes=1)
    assert (grown.drawn, grown.kept) == (2, 3)
    assert contents(folder) == contents(whole)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("keep")
    with pytest.raises(OutputError, match="holds other files; give a new or empty folder"):
        dataset(spec_of(), tmp_path / "mine", items=1)
    with pytest.raises(OutputError, match="does not exist; create it first"):
        dataset(spec_of(), tmp_path / "none" / "pairs", items=1)


def test_the_flared_picture_is_the_sum_of_its_layers(linear):
    def read(part, index):
        return read_exr(linear / "train" / part / f"{index:08d}.exr").layers[0].pixels

    for index in range(2):
        clean, flared, ghosts, starburst = (read(part, index) for part in ("clean", "flared", "ghosts", "starburst"))
        # half floats have 11 bits
        np.testing.assert_allclose(flared, clean + ghosts + starburst, rtol=2**-9, atol=0)
        assert mean_luminance(clean) == pytest.approx(0.18, rel=1e-3)
        assert starburst.max() > 10.0


def test_render_draws_an_item_again_from_its_project(linear):
    record = json.loads((linear / "train" / "parameters" / "00000001.json").read_text())
    drawn = render(read_project(linear / "train" / "project" / "00000001.toml"))
    layers = {layer.name: layer for layer in drawn.layers}
    scale = drawn.summary["scene_irradiance_per_radiance"]
    assert scale == pytest.approx(record["scene_irradiance_per_radiance"], rel=1e-12)
    held = read_exr(linear / "train" / "starburst" / "00000001.exr").layers[0].pixels
    again = layers["starburst"].pixels / scale
    assert (np.abs(held - again) <= np.maximum(2**-9 * again, 1e-6)).all()
    assert record["ghosts"]
    assert {f"ghost.{one['name']}" for one in record["ghosts"]} <= set(layers)


def test_the_sharp_image_of_a_light_holds_the_light_of_its_starburst(tmp_path):
    # two ways to one number: the field angle alone, and the traced pupil over the scale of the plate
    spec = spec_of(
        lens={"names": "heliar-tronnier", "stops_down": 4.0}, light_in_clean="image", splits={"train": 1.0},
        lights={"stops": 4.0, "place": {"kind": "field", "x_deg": 1.0, "y_deg": -0.5}}, exposure={"stops": -2.0},
        sensor={"tone": "linear", "clip": False}, format="exr",
    )  # fmt: skip
    drawn = draw_pictures(spec, 0, ())
    background = draw_pictures(spec.replace(light_in_clean="none"), 0, ())
    (light,) = drawn.record["lights"]
    sharp = drawn.linear["clean"].sum(dtype="f8") - background.linear["clean"].sum(dtype="f8")
    assert sharp == pytest.approx(drawn.linear["starburst"].sum(dtype="f8"), rel=5e-3)
    weights = drawn.linear["starburst"].sum(axis=2, dtype="f8")
    y, x = np.mgrid[:48, :64] + 0.5
    centre = (weights * x).sum() / weights.sum(), (weights * y).sum() / weights.sum()
    assert centre == pytest.approx(light["place_px"], abs=0.7)
    assert drawn.light_mask[int(light["place_px"][1]), int(light["place_px"][0])] == 1


def test_settings_that_exclude_each_other_are_refused_in_python_too(tmp_path):
    with pytest.raises(ProjectError, match=r'format = "exr" holds linear light'):
        dataset(spec_of(format="exr"), tmp_path / "pairs", items=1)
    assert list(tmp_path.iterdir()) == []


def test_a_picture_without_lights_is_clean():
    spec = spec_of(lights={"count": 0}, sensor={}, layout="folder", splits={"train": 1.0})
    drawn = draw_pictures(spec, 0, ())
    assert np.array_equal(drawn.linear["clean"], drawn.linear["flared"])
    assert not drawn.light_mask.any()
    assert drawn.record["lights"] == drawn.record["ghosts"] == []


def test_backgrounds_are_crops_of_a_folder(tmp_path):
    (tmp_path / "deep").mkdir()
    ramp = np.repeat(np.arange(0, 240, 2, dtype=np.uint8)[None, :, None], 90, axis=0).repeat(3, axis=2)
    Image.fromarray(ramp).save(tmp_path / "deep" / "b.png")
    np.save(tmp_path / "a.npy", np.full((60, 80, 3), 3.5, np.float32))
    (tmp_path / "notes.txt").write_text("no picture")
    spec = spec_of(background={"folder": str(tmp_path), "crop": 0.5})
    names = list_backgrounds(spec)
    assert names == ("a.npy", "deep/b.png")
    seen = {}
    for index in range(12):
        pixels, about = background_of(spec, index, names)
        assert pixels.shape == (48, 64, 3)
        seen.setdefault(about["file"], []).append((pixels, about))
    assert seen["a.npy"][0][0] == pytest.approx(3.5)
    for pixels, about in seen["deep/b.png"]:
        left, _, right, _ = about["crop"]
        assert right - left == pytest.approx(0.5 * 120)
        coded = np.maximum(2 * (np.linspace(left, right, 99) - 0.5) / 255, 0.0)
        # decoded from sRGB before it is resized
        assert pixels.mean() == pytest.approx((((coded + 0.055) / 1.055) ** 2.4).mean(), rel=0.02, abs=0.003)
        assert (pixels[0, 0, 0] > pixels[0, -1, 0]) == about["flipped"]
    (tmp_path / "empty").mkdir()
    with pytest.raises(ProjectError, match="holds no pictures"):
        list_backgrounds(spec_of(background={"folder": str(tmp_path / "empty")}))
    with pytest.raises(ProjectError, match="there is no folder"):
        list_backgrounds(spec_of(background={"folder": str(tmp_path / "none")}))
    (tmp_path / "empty" / "gone.png").symlink_to(tmp_path / "nowhere.png")
    with pytest.raises(ProjectError, match=r"gone\.png is a link that leads to no file"):
        run.plan_of(spec_of(background={"folder": str(tmp_path / "empty")}), tmp_path / "pairs")
    (tmp_path / "a.npy").write_bytes(b"no array")
    with pytest.raises(FlarewrightError, match=r"background a\.npy: "):
        background_of(spec, 12, ("a.npy",))


@pytest.mark.parametrize(("side", "size"), [(28, 100), (21, 300), (29, 360)])
def test_the_largest_crop_is_the_whole_picture(tmp_path, side, size):
    """Its sides were an ulp longer than the picture, and Pillow refused the corner beyond it."""
    np.save(tmp_path / "a.npy", np.ones((side, side, 3), np.float32))
    spec = spec_of(background={"folder": str(tmp_path), "crop": 1.0}, size_px=(size, size))
    assert background_of(spec, 0, ("a.npy",))[1]["crop"] == [0.0, 0.0, side, side]


def test_the_layout_of_flare7k(tmp_path):
    spec = spec_of(
        layout="flare7k", lens={"names": LENSES}, splits={"train": [LENSES[0]], "test": [LENSES[1]]}, sensor={}, seed=1,
    )  # fmt: skip
    plain = DatasetSpec.model_validate({key: value for key, value in spec if key != "items_per_shard"})
    result = dataset(plain, tmp_path / "set", items=4, processes=1)
    assert set(result.splits) == {"train", "test"}
    folder = tmp_path / "set"
    names = {path.parent.relative_to(folder).as_posix() for path in folder.rglob("*.png")}
    scattering = "Flare7K/Scattering_Flare"
    assert names == {
        f"{scattering}/Compound_Flare", f"{scattering}/Light_Source", f"{scattering}/Streak",
        "Flare7K/Reflective_Flare", "test_data/synthetic/input", "test_data/synthetic/gt", "test_data/synthetic/mask",
    }  # fmt: skip
    # its loader pairs flares with light sources by their sorted names
    flares, sources = (sorted(path.name for path in (folder / scattering / name).iterdir())
                       for name in ("Compound_Flare", "Light_Source"))  # fmt: skip
    assert flares == sources
    for path in (folder / "test_data/synthetic/mask").iterdir():
        colours = {tuple(colour) for colour in np.asarray(Image.open(path)).reshape(-1, 3).tolist()}
        assert colours <= {(0, 0, 0), (255, 0, 0), (255, 255, 0), (0, 0, 255)}
        assert (0, 0, 255) in colours


def test_machines_that_start_together_share_the_folder(tmp_path):
    """The unfinished description of another machine used to make the folder a foreign one."""
    folder = tmp_path / "pairs"
    folder.mkdir()
    (folder / ".dataset.x1y2.part.json").write_text("{")
    assert dataset(spec_of(), folder, items=2, processes=1, threads=1).drawn == 2
    (folder.parent / "other").mkdir()
    (folder.parent / "other" / "notes.txt").write_text("mine")
    with pytest.raises(OutputError, match="holds other files"):
        dataset(spec_of(), folder.parent / "other", items=2, processes=1)
