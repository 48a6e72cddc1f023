"""Predict the flare of one camera: curves, their extremes and bins, contrast, and a check of their accuracy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..render.scattering.veiling_glare import VeilingGlare
from ..typing import Floats, Pixels, Progress
from .contrast import contrast
from .curves import Check, Curves, bins_of, check_curves, sample_curves
from .flare import Flare, Frame
from .pictures import Memory, Spread, draw_all, in_colour
from .statistics import NAMES
from .table import FlareTable

# number of pictures in the report
SHOWN = 8


@dataclass(frozen=True)
class Flares:
    """One camera's flare in the qualities that a prediction needs.

    Attributes
    ----------
    sampled : Flare
        For statistics; covers a square if it can be rotated.
    frame : Frame
        Sensor of the camera.
    quality : str
        Quality of `sampled`: "draft", "final" or "measured".
    judge : Flare or None
        At full quality over the frame, with pixels as wide as those of `sampled`; None: nothing better exists.
    shown : Flare
        Over the frame, for viewing.
    """

    sampled: Flare
    frame: Frame
    quality: str
    judge: Flare | None
    shown: Flare


@dataclass(frozen=True)
class Setting:
    """Light and scene that give the curves absolute values.

    Attributes
    ----------
    illuminance_lx : float
        Illuminance by the light on a plane facing it.
    luminance_cd_m2 : tuple of float or None
        Darkest and brightest luminance of the scene; None: no contrast is computed.
    """

    illuminance_lx: float = 1e5
    luminance_cd_m2: tuple[float, float] | None = None


@dataclass(frozen=True)
class Wanted:
    """Settings of a prediction.

    Attributes
    ----------
    to_deg : float or None
        Largest constellation; None: the largest known one.
    roll_deg : float
    tolerance : float
    samples : int
        As in `curves.sample_curves`.
    checks : int
        Number of constellations at which the curves are compared with `Flares.judge`.
    bins : int
    setting : Setting
    pictures : bool
    """

    to_deg: float | None = None
    roll_deg: float = 0.0
    tolerance: float = 0.03
    samples: int = 48
    checks: int = 4
    bins: int = 5
    setting: Setting = Setting()
    pictures: bool = False


@dataclass(frozen=True)
class Occurrence:
    """Result of `flarewright predict LENS`.

    Attributes
    ----------
    flare : Flare
        The flare that was sampled.
    frame : Frame
    quality : str
        "draft", "final" or "measured".
    curves : Curves
    bins : int
    check : Check or None
    glare : VeilingGlare or None
    setting : Setting
    pictures : tuple of (float, ndarray)
        Constellations and their linear pictures, shape (H, W, 3).
    """

    flare: Flare
    frame: Frame
    quality: str
    curves: Curves
    bins: int
    check: Check | None
    glare: VeilingGlare | None
    setting: Setting
    pictures: tuple[tuple[float, Pixels], ...] = ()

    @property
    def veil_cd_m2(self) -> Floats:
        """Luminance of a scene that would give the sensor the same mean illuminance as the flare, per constellation."""
        lux = self.setting.illuminance_lx if self.flare.per_lux else 1.0
        return self.curves.column("mean") * lux / self.flare.scene_scale


def predict_occurrence(
    flares: Flares,
    wanted: Wanted,
    progress: Callable[[str], Progress],
    memory: Memory | None = None,
    spread: Spread | None = None,
) -> Occurrence:
    """Sample, check and draw the flare of a camera over the constellation.

    Parameters
    ----------
    flares : Flares
    wanted : Wanted
    progress : callable
        Called with the name of a part of the work; returns the progress callback of that part.
    memory : dict, optional
        Pictures drawn before; new ones are added.
    spread : callable, optional
        Draws pictures by other processes; the prediction does not depend on it.

    Returns
    -------
    Occurrence
        Without the veiling glare, which requires a lens.
    """
    known: Memory = {} if memory is None else memory
    table = FlareTable(flares.sampled, flares.frame, drawn=known.setdefault(flares.sampled.fingerprint, {}))
    curves = sample_curves(
        table, to_deg=wanted.to_deg, roll_deg=wanted.roll_deg, tolerance=wanted.tolerance, most=wanted.samples,
        progress=progress("curves"), spread=spread,
    )  # fmt: skip
    check = None
    if flares.judge is not None and wanted.checks > 0:
        check = check_curves(curves, flares.judge, wanted.checks, progress("checks"), known, spread)
    pictures: list[tuple[float, Pixels]] = []
    if wanted.pictures:
        angles = _worth_a_look(curves)
        requests = [in_colour(flares.shown, known, angle, wanted.roll_deg) for angle in angles]
        pictures = list(zip(angles, draw_all(requests, spread, progress("pictures")), strict=True))
    return Occurrence(
        flares.sampled, flares.frame, flares.quality, curves, wanted.bins, check, None, wanted.setting, tuple(pictures)
    )


def _worth_a_look(curves: Curves) -> list[float]:
    """Choose constellations for pictures: the extremes, and even spacing over the range with flare."""
    at, flux = curves.constellation_deg, curves.column("sum_mm2")
    lit = at[flux > 0.01 * flux.max()] if flux.max() > 0.0 else at
    chosen = {float(at[int(np.argmax(curves.column(name)))]) for name in ("maximum", "log_average")}
    for angle in np.linspace(0.0, float(lit.max()), SHOWN - len(chosen)):
        chosen.add(float(at[int(np.argmin(np.abs(at - angle)))]))
    return sorted(chosen)


def contrast_curve(found: Occurrence) -> Floats | None:
    """Return K_real / K_ideal over the constellation, or None without a scene."""
    if found.setting.luminance_cd_m2 is None:
        return None
    low, high = found.setting.luminance_cd_m2
    return np.array([contrast(high, low, float(veil)).ratio for veil in found.veil_cd_m2])


def occurrence_data(found: Occurrence) -> dict[str, Any]:
    """Return the prediction as the data that `--json` prints."""
    curves, flare = found.curves, found.flare
    at = curves.constellation_deg
    statistics: dict[str, Any] = {}
    for name in NAMES:
        values = curves.column(name)
        edges, bins = bins_of(values, found.bins)
        low, high = int(np.argmin(values)), int(np.argmax(values))
        statistics[name] = {
            "values": values.tolist(),
            "least": {"value": float(values[low]), "constellation_deg": float(at[low])},
            "most": {"value": float(values[high]), "constellation_deg": float(at[high])},
            "bin_edges": edges.tolist(),
            "bins": bins.tolist(),
        }
    data: dict[str, Any] = {
        "camera": flare.name,
        "f_number": flare.f_number,
        "efl_mm": flare.efl,
        "frame_mm": [found.frame.width, found.frame.height],
        "pixel_mm": flare.pitch_mm,
        "quality": found.quality,
        "roll_deg": curves.roll_deg,
        "scene_irradiance_per_radiance": flare.scene_scale,
        "constellation_deg": at.tolist(),
        "unit": flare.unit,
        "statistics": statistics,
        "worst_step": curves.worst_step,
        "illuminance_lx": found.setting.illuminance_lx if flare.per_lux else None,
        "veil_cd_m2": found.veil_cd_m2.tolist(),
    }
    ratio = contrast_curve(found)
    if ratio is not None and found.setting.luminance_cd_m2 is not None:
        low_cd, high_cd = found.setting.luminance_cd_m2
        data["scene_luminance_cd_m2"] = [low_cd, high_cd]
        ideal = contrast(high_cd, low_cd, 0.0).k_ideal
        data |= {"k_ideal": ideal, "k_real": (ideal * ratio).tolist(), "k_ratio": ratio.tolist()}
    if found.check is not None:
        data["check"] = {
            "constellation_deg": found.check.constellation_deg.tolist(),
            **{
                name: {
                    "predicted": found.check.predicted[:, k].tolist(),
                    "rendered": found.check.rendered[:, k].tolist(),
                }
                for k, name in enumerate(NAMES)
            },
        }
    if found.glare is not None:
        data["veiling_glare"] = asdict(found.glare)
    data["remarks"] = list(flare.remarks)
    return data
