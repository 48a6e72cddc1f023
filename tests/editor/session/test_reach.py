"""Files that the page may open and save."""

import sys
from types import UnionType
from typing import Union, get_args, get_origin

import numpy as np
import pytest
from pydantic import BaseModel

from flarewright.editor.preview.display_image import png
from flarewright.editor.server.uploads import take_in
from flarewright.editor.session.files import project_for_lens
from flarewright.editor.session.history import committed, started
from flarewright.editor.session.reach import Reach, files_of, reach_of
from flarewright.editor.session.session import begin
from flarewright.errors import FlarewrightError, OutputError, ProjectError
from flarewright.io.files.state_folder import state_folder
from flarewright.io.lens.library import lens_path
from flarewright.io.project.named_files import FIELDS
from flarewright.io.project.project_text import project_text
from flarewright.model import Holdout, Project

OUTSIDE = "is outside the folders of this editor; start it with --root"


@pytest.fixture
def session(tmp_path):
    """Return a session whose page may use one folder, `in`."""
    (tmp_path / "in").mkdir()
    (tmp_path / "out").mkdir()
    found, _ = begin(None)
    found.reach = reach_of([tmp_path / "in", state_folder() / "imports"], found.history)
    yield found
    found.writer.close()


def test_the_page_reads_and_writes_under_the_folders_only(session, tmp_path):
    inside, outside = tmp_path / "in", tmp_path / "out"
    for folder in (inside, outside):
        (folder / "lens.toml").write_text(lens_path("tessar-brendel").read_text("utf-8"), "utf-8")
        (folder / "grey.png").write_bytes(png(np.full((8, 8, 3), 128, dtype=np.uint8)))
    session.open("biotar-50-f1.4")
    session.open(str(inside / "lens.toml"))
    session.do("choose_lens", {"lens": "heliar-tronnier"})
    session.do("choose_lens", {"lens": str(inside / "lens.toml")})
    session.do("set_iris", {"values": {"mask": str(inside / "grey.png")}})
    session.do("set_plate", {"values": {"image": str(inside / "grey.png")}})
    session.open(str(inside / "grey.png"))
    assert session.save(str(inside / "shot.toml")).is_file()
    for nothing in ("", ".", "/"):
        with pytest.raises(OutputError, match="the project needs a file name"):
            session.save(nothing)
    before, view = session.project, session.view
    (inside / "link.toml").symlink_to(outside / "lens.toml")
    out = str(outside / "grey.png")
    for asked in (
        lambda: session.open(str(outside / "lens.toml")),
        lambda: session.open(str(inside / ".." / "out" / "lens.toml")),
        # a link counts as what it leads to
        lambda: session.open(str(inside / "link.toml")),
        # whether a file exists is not reported
        lambda: session.open(str(outside / "none.toml")),
        lambda: session.open("/etc/passwd"),
        lambda: session.save(str(outside / "shot.toml")),
        lambda: session.save("~/shot.toml"),
        lambda: session.do("choose_lens", {"lens": str(outside / "lens.toml")}),
        lambda: session.do("set_iris", {"values": {"mask": out}}),
        lambda: session.do("set_dirt", {"values": {"image": out}}),
        lambda: session.do("set_holdout", {"light": None, "values": {"depth": out}}),
        lambda: session.do("set_holdout", {"light": 0, "values": {"image": out}}),
        lambda: session.do("set_plate", {"values": {"image": out}}),
        lambda: session.open(out),
    ):
        with pytest.raises(ProjectError, match=OUTSIDE):
            asked()
    assert (session.project, session.view) == (before, view)
    assert not (outside / "shot.toml").exists()
    with pytest.raises(FlarewrightError):
        session.open("~nosuchuser/x.toml")


def test_a_misspelt_lens_is_reported_as_one(session, tmp_path, monkeypatch):
    """Also where the folder of the program is outside: then whether a file of the name exists is not reported."""
    monkeypatch.chdir(tmp_path)
    sentence = r"'takumar-50-f1.5' is outside|'takumer' is neither a shipped lens \(did you mean takumar-50-f1.4"
    for text in ("takumer", "takumer"):
        for asked in (lambda: session.open(text), lambda: session.do("choose_lens", {"lens": text})):  # noqa: B023
            with pytest.raises(ProjectError, match=sentence):
                asked()
        (tmp_path / "takumer").write_text("")
    with pytest.raises(ProjectError, match=OUTSIDE):
        session.open("takumer.toml")
    # quoted, so that no page takes the name for the first word of a sentence and capitalises it
    with pytest.raises(ProjectError, match="'passwd' is outside"):
        session.open("/etc/passwd")


def test_a_project_may_not_lead_out_of_the_folders(session, tmp_path):
    inside, outside = tmp_path / "in", tmp_path / "out"
    (outside / "secret.png").write_bytes(png(np.full((8, 8, 3), 128, dtype=np.uint8)))
    (outside / "lens.toml").write_text(lens_path("tessar-brendel").read_text("utf-8"), "utf-8")
    before = session.project
    picture = before.replace(dirt=before.dirt.replace(image=str(outside / "secret.png")))
    for led in (picture, before.replace(lens=str(outside / "lens.toml"))):
        text = project_text(led)
        (inside / "led.toml").write_text(text, "utf-8")
        with pytest.raises(ProjectError, match=OUTSIDE):
            session.open(str(inside / "led.toml"))
        with pytest.raises(FlarewrightError, match="is outside the folders"):
            take_in(session, "led.toml", text.encode())
    # nor through the mask of a lens file
    mask = f'[iris]\nmask = "{outside / "secret.png"}"'
    lens = lens_path("tessar-brendel").read_text("utf-8")
    assert "[iris]" in lens
    (inside / "lens.toml").write_text(lens.replace("[iris]", mask), "utf-8")
    with pytest.raises(FlarewrightError, match=OUTSIDE):
        session.do("choose_lens", {"lens": str(inside / "lens.toml")})
    assert session.project == before
    # a dropped picture is kept in the state folder, which the page does use
    take_in(session, "sky.png", (outside / "secret.png").read_bytes())
    assert session.project.plate is not None


def test_what_was_opened_at_the_start_stays_within_reach(tmp_path, project):
    beside, away = tmp_path / "beside", tmp_path / "away"
    held = project.replace(holdout=Holdout(image=str(away / "matte.png")))
    history = committed(started(project), held, "Open", file=str(beside / "shot.toml"), begins=True)
    reach = reach_of([], history)
    for path in (beside / "other.toml", away / "matte.png"):
        reach.check(path)
    with pytest.raises(ProjectError, match=OUTSIDE):
        reach.check(away / "other.png")
    Reach().check("/etc/passwd")


def test_every_field_that_names_a_picture_is_known():
    """A new field of a picture gets a known name, or its name is added to `reach.FIELDS`."""
    seen, found = set(), set()

    def walk(kind):
        if get_origin(kind) is not None or isinstance(kind, UnionType | type(Union)):
            for inner in get_args(kind):
                walk(inner)
        elif isinstance(kind, type) and issubclass(kind, BaseModel) and kind not in seen:
            seen.add(kind)
            for name, field in kind.model_fields.items():
                words = f"{name} {field.description or ''} {kind.__doc__ or ''}"
                if str in get_args(field.annotation) or field.annotation is str:
                    line = next((part for part in words.split("\n") if part.strip().startswith(f"{name} :")), "")
                    after = words.partition(line)[2].strip().split("\n")[0] if line else field.description or ""
                    if "ath of" in after or "icture" in after:
                        found.add(name)
                walk(field.annotation)

    walk(Project)
    assert {"image", "mask"} <= found <= set(FIELDS), found


@pytest.mark.skipif(sys.platform == "win32", reason="paths of other systems")
def test_all_files_of_a_project_are_named(project):
    named = project.replace(
        lens="/a/lens.toml", holdout=Holdout(depth="/b.exr"), dirt=project.dirt.replace(image="/c.png"),
        iris=project.iris.replace(mask="/d.png"),
        lights=(project.lights[0].replace(holdout=Holdout(image="/e.png")),),
    )  # fmt: skip
    assert sorted(files_of(named)) == ["/a/lens.toml", "/b.exr", "/c.png", "/d.png", "/e.png"]
    assert files_of(project_for_lens("tessar-brendel")) == ()
