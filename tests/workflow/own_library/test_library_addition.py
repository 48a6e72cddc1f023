"""The user's library: what is added is the lens of the file, once, under a free name, also with several processes."""

import os
from dataclasses import replace
from threading import Barrier, Thread
from zipfile import ZipFile

import numpy as np
import pytest
from PIL import Image

import flarewright as fw
from flarewright.errors import FileError, LensError, OutputError, ProjectError
from flarewright.io.lens.lens_writer import write_lens
from flarewright.io.lens.library import is_own, lens_path, library_name, near_names
from flarewright.io.lens.own.folder import lenses_folder, library_folder, own_lenses
from flarewright.io.lens.own.index import index_path
from flarewright.render.scene.resolve import open_lens
from flarewright.workflow.lens_export import export_lens
from flarewright.workflow.own_library import own_lenses as lists
from flarewright.workflow.own_library.addition import add_lenses
from flarewright.workflow.own_library.own_lenses import own_library, remove_lens

SHIPPED = ("tessar-brendel", "triplet-pestrecov", "petzval-kodak")


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Write lens files of several formats, a broken one, and what is no lens."""
    folder = tmp_path_factory.mktemp("lenses")
    (folder / "zoom").mkdir()
    for name, file in zip(SHIPPED, ("Zeiss Tessar.zmx", "Triplet.csv", "Petzval.lens"), strict=True):
        export_lens(open_lens(name).lens, folder / file)
    export_lens(open_lens("canon-70-200").lens, folder / "zoom" / "Canon EF 70-200.zmx")
    (folder / "broken.zmx").write_text("NAME no lens\n")
    (folder / "readme.txt").write_text("lenses\n")
    (folder / "shot.toml").write_text('lens = "tessar-brendel"\n[[lights]]\nfield_deg = [1.0, 2.0]\n')
    return folder


@pytest.fixture
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("FLAREWRIGHT_STATE", str(tmp_path / "state"))
    return tmp_path / "state"


def test_a_folder_becomes_lenses_that_are_those_of_its_files(files, state):
    found = add_lenses([files])
    names = ["petzval", "triplet", "zeiss-tessar", "canon-ef-70-200"]
    assert sorted(one.name for one in found.added) == sorted(names) == sorted(own_lenses())
    assert found.others == {".txt": 1}
    refused = {one.file.rpartition("/")[2]: one.reason for one in found.refused}
    assert sorted(refused) == ["broken.zmx", "shot.toml"]
    assert "is a project file, not a lens file" in refused["shot.toml"]
    for file, name in (("Zeiss Tessar.zmx", "zeiss-tessar"), ("zoom/Canon EF 70-200.zmx", "Canon EF 70-200")):
        theirs, ours = open_lens(files / file).lens, open_lens(name).lens
        assert ours.rows == theirs.rows
        assert ours.positions == theirs.positions
        assert ours.f_number == theirs.f_number
    zoom = next(one for one in own_library().records if one.name == "canon-ef-70-200")
    stated = [position.focal_length for position in open_lens("canon-70-200").lens.positions]
    assert zoom.efl_range_mm == pytest.approx((min(stated), max(stated)), rel=0.01)
    assert zoom.maker == "Canon"
    tessar = next(one for one in found.added if one.name == "zeiss-tessar")
    assert tessar.efl_mm == pytest.approx(fw.paraxial("tessar-brendel").efl, rel=1e-6)
    assert tessar.surfaces == 7


def test_a_second_addition_reads_nothing_twice(files, state):
    first = add_lenses([files])
    before = {path: path.stat().st_mtime_ns for path in own_lenses().values()}
    again = add_lenses([files])
    assert again.added == ()
    assert {name for _, name in again.known} == {one.name for one in first.added}
    assert {path: path.stat().st_mtime_ns for path in own_lenses().values()} == before
    # a removed one comes back, and only that one
    remove_lens("Zeiss Tessar")
    assert [one.name for one in add_lenses([files]).added] == ["zeiss-tessar"]


def test_an_archive_adds_the_lenses_of_its_folder(files, state, tmp_path):
    place = tmp_path / "all.zip"
    with ZipFile(place, "w") as archive:
        for path in files.rglob("*.*"):
            archive.write(path, path.relative_to(files))
    packed = add_lenses([place])
    assert len(packed.added) == 4
    # the same bytes are the same lens, in a folder or packed
    assert len(add_lenses([files]).known) == 4
    assert {one.file for one in packed.added} == {f"{place}: {one}" for one in (
        "Zeiss Tessar.zmx", "Triplet.csv", "Petzval.lens", "zoom/Canon EF 70-200.zmx"
    )}  # fmt: skip
    assert all(one.file in one.reason for one in packed.refused)
    # not the name under which it was unpacked
    made = next(one for one in packed.added if one.name == "zeiss-tessar")
    assert "from Zeiss Tessar.zmx" in made.source + made.notes
    assert "lens.zmx" not in own_lenses()["zeiss-tessar"].read_text() + made.source + made.notes


def test_a_name_for_a_lens_that_is_there_has_no_effect_and_says_so(state, tmp_path):
    file = tmp_path / "mine.toml"
    write_lens(open_lens("triplet-pestrecov").lens, file)
    add_lenses([file])
    found = add_lenses([file], name="other")
    assert found.known == ((str(file), "mine"),)
    assert found.remarks == (f"--name has no effect: {file} is in the library, as mine",)


def test_the_name_of_a_shipped_lens_stays_its_own(state, tmp_path):
    file = tmp_path / "Tessar Brendel.toml"
    write_lens(open_lens("triplet-pestrecov").lens, file)
    found = add_lenses([file])
    assert found.added[0].name == "tessar-brendel-2"
    assert found.remarks == (f"tessar-brendel is the name of a shipped lens; {file} is added as tessar-brendel-2",)
    assert library_name("tessar-brendel-2") == "tessar-brendel-2"
    assert "tessar-brendel-2" in near_names("tessar-brendl-2")
    # a later version of the program ships a lens of that name
    os.rename(own_lenses()["tessar-brendel-2"], lenses_folder() / "tessar-brendel.toml")
    assert lens_path("tessar-brendel").parent != lenses_folder()
    assert not is_own("tessar-brendel")
    assert "is the name of a shipped lens, which commands use" in own_library().remarks[0]


def test_a_name_that_is_given_is_used_or_refused(files, state):
    assert add_lenses([files / "Triplet.csv"], name="Mine", maker="Me").added[0].name == "mine"
    assert own_library().records[0].maker == "Me"
    with pytest.raises(ProjectError, match="the name mine is taken"):
        add_lenses([files / "Petzval.lens"], name="mine")
    with pytest.raises(ProjectError, match=r"--name gives one lens its name, and .* holds 6 files"):
        add_lenses([files], name="mine")
    with pytest.raises(ProjectError, match="and 2 places are given; add them one by one"):
        add_lenses([files / "Triplet.csv", files / "Petzval.lens"], name="two")


def test_additions_at_the_same_time_lose_nothing_and_add_nothing_twice(files, state):
    start, results = Barrier(3), []

    def add():
        start.wait()
        results.append(add_lenses([files]))

    threads = [Thread(target=add) for _ in range(3)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    added = [one.name for result in results for one in result.added]
    assert sorted(added) == sorted(own_lenses())
    assert len(added) == 4
    assert all(len(result.added) + len(result.known) == 4 for result in results)


@pytest.mark.parametrize("damage", ["missing", "cut", "other"])
def test_a_damaged_index_is_made_again_from_the_lens_files(files, state, damage, monkeypatch):
    add_lenses([files])
    whole = own_library()
    assert whole.remarks == ()
    text = index_path().read_text()
    if damage == "missing":
        index_path().unlink()
    else:
        index_path().write_text(text[: len(text) // 2] if damage == "cut" else '{"lenses": []}')
    # the records are in the lens files: no lens is opened
    monkeypatch.setattr(lists, "_made_again", lambda name, path: pytest.fail(name))
    again = own_library()
    assert again.records == whole.records
    assert len(again.remarks) == (damage != "missing")
    assert own_library() == whole


def test_a_current_index_is_all_that_a_list_reads(files, state, monkeypatch):
    add_lenses([files])
    whole = own_library()
    monkeypatch.setattr(lists, "read_text", lambda path, what: pytest.fail(str(path)))
    assert own_library() == whole


def test_lenses_that_are_edited_or_copied_by_hand_get_new_records(files, state):
    add_lenses([files / "Triplet.csv"])
    path = own_lenses()["triplet"]
    before = own_library().records[0]
    path.write_text(path.read_text().replace('name = "', 'name = "Leica '))
    write_lens(open_lens("petzval-kodak").lens, lenses_folder() / "By Hand.toml")
    (lenses_folder() / "damaged.toml").write_text("rows = 3")
    library = own_library()
    assert [one.name for one in library.records] == ["By Hand", "triplet"]
    hand, triplet = library.records
    assert replace(triplet, remarks=before.remarks) == replace(before, title=f"Leica {before.title}")
    assert hand.efl_mm == pytest.approx(fw.paraxial("petzval-kodak").efl)
    assert library.remarks[0].startswith("damaged cannot be used")
    # a name in capitals is found as well
    assert open_lens("by_hand").lens.rows == open_lens("petzval-kodak").lens.rows


def test_pictures_of_a_lens_come_to_the_library_and_leave_with_the_last_lens(state, tmp_path):
    lens = fw.load_lens("triplet-pestrecov")
    Image.fromarray(np.full((8, 8), 255, np.uint8)).save(tmp_path / "iris.png")
    for k in range(2):
        write_lens(lens.replace(iris=fw.Iris(mask=str(tmp_path / "iris.png")), notes=str(k)), tmp_path / f"a{k}.toml")
    add_lenses([tmp_path / "a0.toml", tmp_path / "a1.toml"])
    (tmp_path / "iris.png").unlink()
    (picture,) = (library_folder() / "images").iterdir()
    assert os.path.samefile(open_lens("a0").lens.iris.mask, picture)
    remove_lens("a0")
    assert picture.exists()
    remove_lens("a1")
    assert not picture.exists()
    assert own_lenses() == {}


def test_a_lens_cannot_make_the_library_copy_or_delete_other_files(state, tmp_path):
    lens = fw.load_lens("triplet-pestrecov")
    (tmp_path / "secret").write_text("no picture")
    write_lens(lens.replace(iris=fw.Iris(mask=str(tmp_path / "secret"))), tmp_path / "a.toml")
    assert "secret" in add_lenses([tmp_path / "a.toml"]).refused[0].reason
    write_lens(lens.replace(notes='mask = "../images/../../../secret"'), tmp_path / "b.toml")
    add_lenses([tmp_path / "b.toml"])
    remove_lens("b")
    assert (tmp_path / "secret").exists()
    assert list((library_folder() / "images").iterdir()) == []


def test_a_library_that_cannot_be_written_is_reported_in_one_sentence(files, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("FLAREWRIGHT_STATE", str(tmp_path / "file"))
    with pytest.raises(OutputError, match=r"the lens library .* cannot be written .* set FLAREWRIGHT_STATE"):
        add_lenses([files])
    # reading goes on: shipped lenses are found
    assert own_library() == lists.Library(())
    assert lens_path("heliar-tronnier").is_file()


@pytest.mark.parametrize("place", ["nothing", "nothing.zip", "nothing.zmx"])
def test_a_place_that_does_not_exist_is_an_error(state, tmp_path, place):
    with pytest.raises(FileError, match=f"{place} does not exist"):
        add_lenses([tmp_path / place])


def test_removing_what_is_not_there_suggests_a_near_name(files, state):
    add_lenses([files / "Triplet.csv"])
    with pytest.raises(LensError, match="no lens 'tripled': did you mean triplet"):
        remove_lens("tripled")
    with pytest.raises(LensError, match="tessar-brendel is a shipped lens"):
        remove_lens("tessar-brendel")


def test_options_for_lenses_that_are_there_are_reported(files, state, tmp_path):
    """They were dropped without a word: the files are not read again."""
    sequence = tmp_path / "a.seq"
    sequence.write_text(
        "LEN NEW\nEPD 20\nDIM M\nS0 0 1E20\nS1 50 5 517000.642\n STO\nS2 -50 2\nS3 -150 45\nSI 0 0\nGO\n"
    )
    places = [files / "Petzval.lens", files / "Triplet.csv", sequence]
    first = {"maker": "Me", "apertures": "diameters", "first_column": "radii"}
    assert add_lenses(places, **first).remarks == ()
    words = "has no effect on lenses that the library has:"
    again = add_lenses(places, **first).remarks
    assert [remark.partition(";")[0] for remark in again] == [
        f"--apertures {words} petzval", f"--first-column {words} a",
    ]  # fmt: skip
    other = add_lenses(places, maker="Other").remarks
    assert [remark.partition(";")[0] for remark in other] == [f"--maker {words} petzval, triplet, a"]
    assert {record.maker for record in own_library().records} == {"Me"}


def test_options_without_effect_are_reported(files, state):
    found = add_lenses([files / "Triplet.csv"], apertures="diameters", first_column="radii")
    assert found.remarks == (
        "--apertures has no effect: there is no .lens file", "--first-column has no effect: there is no .seq file",
    )  # fmt: skip
