"""Golden layers: pictures of three lenses from the last time they were checked by eye and by the physics tests.

They detect that a picture changed, not that it is correct. Rounding may differ between machines: the compiler orders
sums and fuses multiply and add differently, which moves a ray by 1e-12 mm and changes the last bits of a pixel. Where
that rounding flips a decision of the adaptive grid, a few pixels along an edge can change by more. So pixels are
compared twice: nearly all of them to 1e-4 of the layer's maximum, and the mean error to 1e-6 of it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flarewright.io.images.exr import read_exr, write_exr
from flarewright.model import Camera, Iris, Light, Output, Preset, Project, Quality
from flarewright.render.render import Rendering, render

FOLDER = Path(__file__).parent
SIZE = (128, 72)

ROUNDING = 1e-4
NEARLY_ALL = 0.998
MEAN = 1e-6

SCENES = {
    "heliar-tronnier": {"f_number": 5.6, "coating": Preset(name="thesis"), "iris": Iris(blades=6)},
    "canon-28-80": {"f_number": 8.0, "iris": Iris(blades=7, rounding=0.3, rotation_deg=10.0)},
    "tessar-brendel": {"f_number": 2.8, "iris": Iris()},
}
PATHS = {"heliar-tronnier": "all", "canon-28-80": "same-side", "tessar-brendel": "all"}
FIELDS = {"heliar-tronnier": (9.0, 5.0), "canon-28-80": (14.0, -6.0), "tessar-brendel": (6.0, 4.0)}
SENSORS = {"heliar-tronnier": (72.0, 40.5), "canon-28-80": (36.0, 20.25), "tessar-brendel": (72.0, 40.5)}
BRIGHTEST = 3


def scene(lens: str, mode: str) -> Project:
    return Project(
        lens=lens,
        lights=(Light(field_deg=FIELDS[lens]),),
        camera=Camera(size_px=SIZE, sensor_mm=SENSORS[lens]),
        quality=Quality(mode=mode, wavelengths=3 if mode == "draft" else 5, paths=PATHS[lens], ringing="off"),
        # both qualities have the same starburst, so one test of it is enough
        output=Output(layers="ghosts", brightest=BRIGHTEST, starburst=mode == "final"),
        **SCENES[lens],
    )


def over_picture(layer) -> np.ndarray:
    whole = np.zeros((SIZE[1], SIZE[0], 3))
    x, y, w, h = layer.window
    whole[y : y + h, x : x + w] = layer.pixels
    return whole


def write(result: Rendering, path: Path) -> None:
    """Write all layers but the beauty, which is their sum; each layer cropped to its light."""
    kept = [layer for layer in result.layers if layer.name != "beauty"]
    about = {"scene": path.stem, "fields": str(FIELDS[path.stem.rsplit(".", 1)[0]])}
    write_exr(path, kept, size_px=SIZE, pixel_type="float", metadata=about)


def differences(name: str, found: np.ndarray, golden: np.ndarray) -> list[str]:
    brightest = np.abs(golden).max()
    error = np.abs(found - golden) / (brightest if brightest > 0.0 else 1.0)
    worst = np.unravel_index(int(error.argmax()), error.shape)
    where = f"worst {error.max():.1e} of the brightest at column {worst[1]}, row {worst[0]}"
    out = []
    if np.quantile(error, NEARLY_ALL) > ROUNDING:
        share = float((error > ROUNDING).mean())
        out.append(f"{name}: {share:.2%} of the values differ by more than {ROUNDING:g}; {where}")
    if error.mean() > MEAN:
        out.append(f"{name}: mean difference {error.mean():.1e} of the brightest; {where}")
    return out


@pytest.mark.parametrize(
    ("lens", "mode"),
    [
        # the zoom has six times as many ghosts
        pytest.param(lens, mode, marks=pytest.mark.slow if (lens, mode) == ("canon-28-80", "final") else ())
        for lens in SCENES
        for mode in ("draft", "final")
    ],
)
def test_layers_look_as_they_did(lens, mode, updating):
    result = render(scene(lens, mode))
    path = FOLDER / f"{lens}.{mode}.exr"
    if updating:
        write(result, path)
        pytest.skip(f"{path.name} written")
    golden = {layer.name: layer for layer in read_exr(path).layers}
    found = {layer.name: layer for layer in result.layers if layer.name != "beauty"}
    assert set(found) == set(golden)
    wrong = []
    for name, layer in golden.items():
        wrong += differences(name, over_picture(found[name]), over_picture(layer))
    assert wrong == [], "see tests/golden/conftest.py for how to replace them, with a reason"


def test_the_goldens_are_small():
    files = list(FOLDER.glob("*.exr"))
    assert len(files) == 2 * len(SCENES)
    assert sum(file.stat().st_size for file in files) < 2_000_000


def test_a_change_is_noticed():
    """The comparison detects a hundredth of a stop, a shift by a pixel, and a missing layer."""
    golden = over_picture(next(x for x in read_exr(FOLDER / "heliar-tronnier.final.exr").layers if x.name == "ghosts"))
    assert differences("same", golden, golden) == []
    assert differences("rounded", golden.astype(np.float32) * np.float32(1 + 1e-7), golden) == []
    assert differences("brighter", golden * 2**0.01, golden)
    assert differences("shifted", np.roll(golden, 1, axis=1), golden)
