"""The folder of a search shows each lens as its file renders alone."""

from __future__ import annotations

from pathlib import Path

import flarewright as fw
from flarewright.design.solvers import pool_search
from flarewright.design.solvers.pool_search import PoolState
from flarewright.io.images.png import encode_png
from flarewright.io.project.project_file import read_project
from flarewright.model import Lens, Medium, Plate, Position, Stop, Surface
from flarewright.render.image.display import view
from flarewright.workflow import SearchLimits, search_in_folder

GLASS = Medium(n_d=1.6, v_d=50.0)
ZOOM = Lens(
    name="a zoom", f_number=8.0,
    rows=(
        Surface(curvature=1 / 40, thickness=4.0, medium=GLASS, semi_diameter=8.0),
        Surface(curvature=-1 / 300, thickness=10.0, semi_diameter=8.0),
        Stop(thickness=6.0),
        Surface(curvature=1 / 60, thickness=3.0, medium=GLASS, semi_diameter=8.0),
        Surface(curvature=-1 / 80, semi_diameter=8.0),
    ),
    positions=(Position(name="wide", gaps=((1, 10.0),)), Position(name="tele", gaps=((1, 5.0),))),
    coating_presets={"old": (None,) * 5},
)  # fmt: skip


def test_found_lenses_are_drawn_without_what_belongs_to_the_lens_of_the_project(tmp_path, monkeypatch):
    """A zoom had no pictures; a filter stood in them twice; the sensor stood where that of the old lens did."""
    monkeypatch.setattr(pool_search, "batch_size", lambda _: 4)
    wanted = fw.GhostTarget(place_mm=2.0, radius_mm=3.0, color=(1.0, 0.5, 0.2))
    camera = fw.Camera(size_px=(64, 48), sensor_distance=60.0, cover_glass=Plate(thickness=1.0))
    lights = (fw.Light(field_deg=(6.0, 3.0)),)
    project = fw.Project(
        lens=ZOOM, zoom="tele", coating=fw.Preset(name="old"), lights=lights, camera=camera,
        filter=Plate(thickness=2.0),
        design=fw.Design(own_ghosts=False, signed=False, ghost_targets=(wanted,), surfaces=4),
    )  # fmt: skip
    found = search_in_folder(project, tmp_path, PoolState(1), SearchLimits(searches=8, lenses=1))
    assert not [remark for remark in found.remarks if "was not rendered" in remark]
    alone = fw.Project(
        lens=str(tmp_path / "lens-1.toml"), lights=lights, camera=fw.Camera(size_px=(64, 48)),
        quality=fw.Quality(mode="draft", wavelengths=3, paths="same-side"),
        output=fw.Output(layers="beauty", starburst=False),
    )  # fmt: skip
    drawn = fw.render(alone).layers[0].pixels
    assert drawn.max() > 0.0
    assert (tmp_path / "lens-1.png").read_bytes() == encode_png(view(drawn), {})
    # the mirrors of its ghosts are numbered without a filter
    colors = read_project(tmp_path / "lens-1.colors.toml")
    assert Path(str(colors.lens)).name == "lens-1.toml"
    assert colors.filter is colors.zoom is None
    assert colors.camera == fw.Camera(size_px=(64, 48))
