"""What was given to `flarewright render` on the command line, before anybody looks at it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..model import Project


@dataclass(frozen=True)
class Flags:
    """What was given on the command line; None and empty: not given."""

    lens: str | None
    project: Path | None
    light: list[str]
    intensity: list[float]
    spectrum: list[str]
    light_diameter: list[float]
    light_size: list[str]
    distance: list[float]
    fstop: float | None
    blades: int | None
    rotation: float | None
    rounding: float | None
    roughness: float | None
    iris_image: Path | None
    dust: float | None
    scratches: float | None
    fingerprint: float | None
    dirt_image: Path | None
    cats_eye: bool
    starburst_size: float | None
    coating: str | None
    focus: float | None
    size: str | None
    sensor: str | None
    sensor_distance: float | None
    quality: str | None
    wavelengths: int | None
    paths: str | None
    ringing: str | None
    layers: str | None
    brightest: int | None
    no_starburst: bool
    colorspace: str | None
    gamut: str | None
    half: bool | None
    mute: list[str]
    solo: list[str]
    gain: list[str]
    physical: bool
    zoom: str | None = None
    filter_plate: str | None = None
    imperfection: str | None = None
    ghost_offset: float | None = None
    cover_glass: str | None = None
    sensor_reflectance: float | None = None
    sensor_grating: str | None = None
    squeeze: float | None = None
    desqueeze: bool = False
    scatter: str | None = None
    surface_roughness: float | None = None
    cleanliness: float | None = None
    holdout: Path | None = None
    depth: Path | None = None
    orders: int | None = None
    order4_limit: float | None = None
    seed: int | None = None
    error: float | None = None
    error_of: str | None = None
    samples: int | None = None
    rays_from: str | None = None
    resumed: Project | None = None
    light_polygon: tuple[str, ...] = ()
    starburst_spiral: float | None = None
    rule: tuple[str, ...] = ()
