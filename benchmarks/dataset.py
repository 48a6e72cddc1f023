"""Training pairs a second and core: items of a data set at 512 x 512, drawn, masked, exposed and encoded in one thread.

CPU time, so that other load on the machine changes little. Each item has another lens, coating, light and background;
the first ones, which fill the caches of lenses and spectra, do not count.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from flarewright.model.project.dataset import DatasetSpec
from flarewright.workflow.training_pairs.layout import item_files
from flarewright.workflow.training_pairs.pictures import draw_pictures

Row = Callable[..., dict[str, Any]]

WARM, ITEMS = 24, 48
BASE = {
    "lens": {
        "names": ["heliar-tronnier", "takumar-50-f1.4", "flektogon-35", "nikkor-85-f1.4", "triplet-pestrecov"],
        "stops_down": {"uniform": [0, 4]},
        "coating": ["lens", "early-multicoat", "quarter-wave:550"],
    },
    "iris": {"blades": [5, 6, 7, 8, 9], "rounding": {"uniform": [0, 0.6]}},
    "lights": {"place": {"kind": "frame", "margin": 0.1}, "stops": {"normal": [0, 2], "bounds": [-4, 4]}},
    "sensor": {"full_well_e": {"log_uniform": [2000, 40000]}, "read_noise_e": 3},
}
WORKS: dict[str, dict[str, Any]] = {
    "draft": {},
    "draft, clean and flared alone": {"parts": ["clean", "flared"]},
    "draft, dirt": {"dirt": {"dust_per_mm2": 0.5}},
    "draft, disc of 0.5 degrees": {"lights": {**BASE["lights"], "diameter_deg": 0.5}},
    "final": {"quality": "final"},
    "final, clean and flared alone": {"quality": "final", "parts": ["clean", "flared"]},
    "final, rings": {"quality": "final", "rings": True},
}


def pairs(row: Row) -> list[dict[str, Any]]:
    """Return the pairs a second of CPU time of each kind of data set."""
    rows = []
    for name, changes in WORKS.items():
        spec = DatasetSpec.model_validate({**BASE, **changes})
        slow = spec.quality == "final" or "dirt" in changes
        warm, items = (WARM // 4, ITEMS // 4) if slow else (WARM, ITEMS)
        for index in range(warm):
            item_files(spec, draw_pictures(spec, index, (), 1), "")
        started = time.process_time()
        for index in range(warm, warm + items):
            item_files(spec, draw_pictures(spec, index, (), 1), "")
        rows.append(row("dataset", name, items / (time.process_time() - started), "pairs/s and core"))
    return rows
