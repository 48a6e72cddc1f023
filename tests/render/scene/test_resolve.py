"""Opening a lens: one record for a name, a file and a prescription in memory."""

from __future__ import annotations

import pytest

from flarewright.io.lens.lens_writer import write_lens
from flarewright.io.lens.library import lens_path
from flarewright.model import Surface
from flarewright.render.scene.resolve import load_lens, open_lens


def without_rims(lens):
    rows = tuple(row.replace(semi_diameter=None) if isinstance(row, Surface) else row for row in lens.rows)
    return lens.replace(rows=rows)


def test_a_name_a_file_and_a_prescription_open_as_the_same_lens(tmp_path):
    named = open_lens("heliar-tronnier")
    write_lens(named.lens, tmp_path / "copy.toml")
    read, given = open_lens(tmp_path / "copy.toml"), open_lens(named.lens)
    assert named.lens == read.lens == given.lens
    assert (named.path, read.path, given.path) == (lens_path("heliar-tronnier"), tmp_path / "copy.toml", None)


def test_what_is_missing_is_estimated_marked_and_reported():
    bare = without_rims(load_lens("heliar-tronnier"))
    opened = open_lens(bare)
    estimated = [row.semi_diameter_estimated for row in opened.lens.rows if isinstance(row, Surface)]
    assert all(estimated)
    assert any(remark.startswith("semi-diameters of all rows estimated") for remark in opened.remarks)
    assert open_lens(opened.lens).lens == opened.lens
    assert not any("estimated" in remark for remark in open_lens(opened.lens).remarks)


def test_a_file_that_changes_is_read_again(tmp_path):
    path, lens = tmp_path / "mine.toml", load_lens("heliar-tronnier")
    for f_number in (3.5, 5.6):
        write_lens(lens.replace(f_number=f_number), path)
        assert open_lens(path).lens.f_number == f_number


@pytest.mark.parametrize("given", [False, True])
def test_load_lens_appends_the_remarks(given, tmp_path):
    write_lens(without_rims(load_lens("heliar-tronnier")), tmp_path / "bare.toml")
    remarks = ["before"] if given else None
    assert load_lens(tmp_path / "bare.toml", remarks=remarks) == open_lens(tmp_path / "bare.toml").lens
    assert not given or remarks == ["before", *open_lens(tmp_path / "bare.toml").remarks]


def test_a_prescription_opens_without_tracing_a_ray(monkeypatch):
    """The first call of a tracer compiles kernels; only the remarks need it."""
    lens = load_lens("heliar-tronnier").replace(name="not opened before")
    asked = []
    monkeypatch.setattr("flarewright.render.scene.resolve.axial_opening", lambda *_: asked.append(1) or (1.0, 0))
    opened = open_lens(lens)
    assert not asked
    assert opened.remarks == ()
    assert asked
