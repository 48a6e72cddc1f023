"""A planned scene as the data that `--json` prints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..render.plots.chart import number
from ..render.scattering.veiling_glare import VeilingGlare
from .plan import Plan, Ranked
from .search import WORTH, BestPosition
from .statistics import NAMES
from .switching import Shot
from .worst import Worst


def time_words(plan: Plan, index: int) -> str:
    """Format a time of a plan: the clock time if the scene has one, otherwise seconds."""
    if plan.dates is None:
        return f"{plan.times_s[index]:.6g} s"
    date = plan.dates[index]
    days = plan.dates[0].date() != plan.dates[-1].date()
    return f"{date:%Y-%m-%d %H:%M:%S}" if days else f"{date:%H:%M:%S}"


def unknown_share(plan: Plan, shot: Shot) -> float:
    """Return the part of a shot's times at which the camera's flare is unknown."""
    return float(np.isnan(plan.veil(shot.camera)[shot.first : shot.until + 1]).mean())


def found_words(plan: Plan, found: BestPosition) -> str:
    """Describe the result of a search for a better position in one sentence."""
    name = plan.scene.cameras[found.camera].name
    tried, old = len(found.veils_cd_m2) - 1, float(found.veils_cd_m2[0])
    if not found.moments:
        return (
            f"the flare of {name} at its position is not known, because its lights are outside the measured range: "
            "no position can be compared"
        )
    unknown = int(np.isnan(found.veils_cd_m2).sum())
    about = f"of {tried} positions within {found.radius_m:g} m of {name}"
    limits = [f"{unknown} of which are where its flare is not known"] if unknown else []
    if found.unknown:
        times = found.moments + found.unknown
        limits.append(f"at the {found.moments} of {times} times at which the flare at its position is known")
    about += "".join(f", {one}" for one in limits) + ("," if limits else "")
    if old == 0.0:
        return f"{name} has no flare at its position; none {about} can be better"
    if not found.better:
        gain = 1.0 - float(found.veils_cd_m2[found.best]) / old
        return f"none {about} removes {WORTH:.0%} of the flare or more (the best {gain:.1%}): the position is good"
    new = float(found.veils_cd_m2[found.best])
    x, y, z = (float(part) for part in found.offsets_m[found.best])
    level = f", {abs(z):.3g} m {'higher' if z > 0 else 'lower'}" if abs(z) > 0.005 else ""
    return (
        f"the best {about} lies {x:+.3g} m along x and {y:+.3g} m along y{level}: mean veil {number(new)} instead of "
        f"{number(old)} cd/m², {1.0 - new / old:.0%} less"
    )


def scene_data(
    plan: Plan,
    ranked: Sequence[Ranked],
    shots: Sequence[Shot],
    found: BestPosition | None,
    worst: Sequence[Worst] = (),
    glare: Sequence[VeilingGlare | None] = (),
) -> dict[str, Any]:
    """Return a planned scene as data for JSON.

    Parameters
    ----------
    plan : Plan
    ranked : sequence of Ranked
    shots : sequence of Shot
        Order of cameras over time; empty for one camera.
    found : BestPosition or None
    worst : sequence of Worst
        Final renders of the worst times.
    glare : sequence of VeilingGlare or None
        By camera.
    """
    data: dict[str, Any] = {
        "scene": plan.scene.name,
        "times_s": plan.times_s.tolist(),
        "dates": None if plan.dates is None else [date.isoformat() for date in plan.dates],
        "ranking": _ranking(plan, ranked, worst),
        "cameras": [_camera(plan, c, glare[c] if c < len(glare) else None) for c in range(len(plan.scene.cameras))],
        "which_camera_when": _shots(plan, shots),
        "remarks": list(plan.remarks),
    }
    if found is not None:
        data["better_position"] = _better_position(plan, found)
    return data


def _ranking(plan: Plan, ranked: Sequence[Ranked], worst: Sequence[Worst]) -> list[dict[str, Any]]:
    """Return the pairs of camera and light, the worst first."""
    cameras, lights = plan.scene.cameras, plan.scene.lights
    rendered = {(one.ranked.camera, one.ranked.light): one for one in worst}
    return [
        {
            "camera": cameras[one.camera].name,
            "light": lights[one.light].name,
            "known_share": one.known_share,
            "mean_veil_cd_m2": one.mean_veil_cd_m2,
            "worst_at_s": None if one.worst is None else float(plan.times_s[one.worst]),
            "worst_veil_cd_m2": one.worst_veil_cd_m2,
            "worst_constellation_deg": one.worst_constellation_deg,
            "contrast_left": one.contrast_left,
            "seen_share": one.seen_share,
            "brightest_stops_from_clipping": one.brightest_stops,
            **_rendered(rendered.get((one.camera, one.light))),
        }
        for one in ranked
    ]


def _shots(plan: Plan, shots: Sequence[Shot]) -> list[dict[str, Any]]:
    """Return the order of cameras over time."""
    return [
        {
            "camera": plan.scene.cameras[shot.camera].name,
            "from_s": float(plan.times_s[shot.first]),
            "to_s": float(plan.times_s[shot.until]),
            "from": time_words(plan, shot.first),
            "to": time_words(plan, shot.until),
            "unknown_share": unknown_share(plan, shot),
        }
        for shot in shots
    ]


def _better_position(plan: Plan, found: BestPosition) -> dict[str, Any]:
    """Return the result of a search for a better position."""
    return {
        "camera": plan.scene.cameras[found.camera].name,
        "radius_m": found.radius_m,
        "height_m": found.height_m,
        "better": found.better,
        "offset_m": found.offsets_m[found.best].tolist() if found.better else [0.0, 0.0, 0.0],
        "mean_veil_cd_m2": float(found.veils_cd_m2[0]),
        "best_mean_veil_cd_m2": float(found.veils_cd_m2[found.best]),
        "positions": found.offsets_m.tolist(),
        "veils_cd_m2": [float(veil) if np.isfinite(veil) else None for veil in found.veils_cd_m2],
        "words": found_words(plan, found),
    }


def _rendered(worst: Worst | None) -> dict[str, Any]:
    """Return the values of the separate render of a worst time."""
    return {
        "rendered_veil_cd_m2": None if worst is None else worst.veil_cd_m2,
        "washed_share": None if worst is None else worst.washed,
    }


def _camera(plan: Plan, c: int, glare: VeilingGlare | None) -> dict[str, Any]:
    camera, table = plan.scene.cameras[c], plan.tables[c][0]
    veil = plan.veil(c)
    left, ideal = plan.contrast_left(veil), plan.ideal_contrast
    out: dict[str, Any] = {
        "name": camera.name,
        "flare": table.flare.name,
        "f_number": table.flare.f_number,
        "lux_per_cd_m2": table.flare.scene_scale,
        "veil_cd_m2": veil.tolist(),
        "contrast_left": None if left is None else left.tolist(),
        "k_ideal": ideal,
        "k_real": None if left is None or ideal is None else (ideal * left).tolist(),
        "lights": [],
    }
    if glare is not None:
        out["veiling_glare_index"] = glare.index
    for k, (light, pair) in enumerate(zip(plan.scene.lights, plan.pairs[c], strict=True)):
        indicator = plan.glare_indicator(c, k)
        seen = pair.sighting
        out["lights"].append(
            {
                "name": light.name,
                "constellation_deg": seen.constellation_deg.tolist(),
                "roll_deg": seen.roll_deg.tolist(),
                "illuminance_lx": seen.illuminance_lx.tolist(),
                "statistics_lx": {name: pair.values[:, n].tolist() for n, name in enumerate(NAMES)},
                "glare_indicator": None if indicator is None else indicator.tolist(),
                "known": pair.known.tolist(),
            }
        )
    return out
