"""A remark reports a lens whose axial beam does not fill its f-number."""

import numpy as np
import pytest

from flarewright.io.lens.library import library_names
from flarewright.model import Surface
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens_import.patent_repair import axial_opening
from flarewright.optics.rays.single_rays import trace_polylines
from flarewright.render.scene.resolve import load_lens, open_lens


def narrowed(row, part):
    """Return the Heliar with one rim at a fraction of the marginal ray's height, and that height as traced."""
    lens = load_lens("heliar-tronnier")
    order = first_order(lens)
    y = np.array([0.5 * part * order.entrance_pupil_diameter])
    height = abs(float(trace_polylines(lens, None, 0.0 * y, y, 0.0, sensor_distance=order.bfl)[0, 1 + row, 1]))
    rows = list(lens.rows)
    rows[row] = rows[row].replace(semi_diameter=height * (1.0 + 1e-6))
    return lens.replace(rows=tuple(rows))


@pytest.mark.parametrize("name", library_names())
def test_a_lens_that_ships_opens_as_it_says_or_its_notes_tell(name):
    """Loading a lens does not repeat the check, because a first command would compile kernels for it."""
    lens = load_lens(name)
    opening, _ = axial_opening(lens, first_order(lens))
    assert opening >= 0.96 - 1e-9
    assert (opening < 0.98 - 1e-9) == ("rims pass f/2.92" in lens.notes)


def test_a_lens_that_opens_as_it_says_is_not_told():
    opened = open_lens(load_lens("heliar-tronnier"))
    lens, remarks = opened.lens, opened.remarks
    assert axial_opening(lens, first_order(lens)) == (1.0, 0)
    assert not any("cuts the beam" in remark for remark in remarks)


@pytest.mark.parametrize(("row", "part"), [(0, 0.5), (3, 0.8), (8, 0.7)])
def test_the_rim_that_cuts_tells_how_far_the_lens_opens(row, part):
    lens = narrowed(row, part)
    assert axial_opening(lens, first_order(lens)) == (pytest.approx(part), row)
    reported = f"row {row} cuts the beam on the axis: the lens passes f/{3.5 / part:.2f}, not f/3.5"
    assert reported in open_lens(lens).remarks


def test_rays_beside_a_surface_are_cut_too():
    """At f/0.35 the beam is twice as wide as the sphere: it loses rays without any rim."""
    lens = load_lens("heliar-tronnier").replace(f_number=0.5)
    bare = lens.replace(
        rows=tuple(row.replace(semi_diameter=None) if isinstance(row, Surface) else row for row in lens.rows)
    )
    opening, _ = axial_opening(bare, first_order(bare))
    assert opening < 0.4


def test_a_lens_that_passes_nothing_is_told():
    lens = load_lens("heliar-tronnier")
    front = lens.rows[0].replace(semi_diameter=0.01)
    remarks = open_lens(lens.replace(rows=(front, *lens.rows[1:]))).remarks
    assert "row 0 cuts the beam on the axis: the lens passes nothing, not f/3.5" in remarks
