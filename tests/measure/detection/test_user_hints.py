"""Ghosts that the user marks in a frame."""

from dataclasses import replace

import pytest
from planted_run import SIZE, views

from flarewright.measure.detection.user_hints import candidate
from flarewright.model.measurement.capture import MergedRun
from flarewright.model.measurement.corrections import MarkedGhost


@pytest.mark.parametrize("roll", [0.0, 90.0, -45.0])
def test_a_mark_belongs_to_the_roll_on_whose_line_it_lies(roll):
    """With frames of several rolls at one constellation, a mark was always taken for one in the first of them."""
    seen = [
        replace(view, constellation_deg=view.constellation_deg + 0.01 * k, nominal_roll_deg=each)
        for k, each in enumerate((0.0, 90.0, -45.0)) for view in views((), angles=(6.0, 12.0, 18.0), roll_deg=each)
    ]  # fmt: skip
    seen.sort(key=lambda view: view.constellation_deg)
    run = MergedRun(size_px=SIZE, frames=(), axis_px=(0.0, 0.0), px_per_rad=900.0)
    there = next(view for view in seen if view.nominal_roll_deg == roll and view.constellation_deg > 11.0)
    x, y, cosine, sine, _ = there.frame
    # a ghost of speed -110, marked a pixel off its centre
    along = -110.0 * there.sigma
    place = float(x + along * cosine + 0.7), float(y - along * sine + 0.7)
    mark = MarkedGhost(constellation_deg=12.0, centre_px=place, radius_px=20.0)
    assert candidate(mark, seen, run, looked=9, factor=1.0).speed == pytest.approx(-110.0, abs=4.0)
