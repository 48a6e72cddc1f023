"""Frozen records of lenses, projects and measurements, validated with pydantic; no algorithms.

The records re-exported here are the public ones. Files are read and written in `flarewright.io`.

- `base`: `Frozen`, the base class of all records
- `bytes_text`: arrays of bytes as base64 text
- `layer`: `Layer`, a named linear image; `part_inside`, its part in a picture
- `matte`: `GhostMatte`, which ghosts light each pixel
- `lens`: prescriptions, coatings, glasses, iris, plates
- `project`: projects, cameras, lights, art direction, design targets, scenes
- `measurement`: captures, merged frames, ghost models, tracks
"""

from .layer import Layer
from .lens.coating import Bare, Coating, Film, QuarterWave, Stack, Standard
from .lens.figure import Figure
from .lens.glass import Dispersion, Medium
from .lens.grating import SensorGrating
from .lens.imperfection import Imperfection
from .lens.iris import Iris
from .lens.plate import Plate
from .lens.prescription import Element, Lens, Position, Row, Stop, Surface
from .lens.scatter import RowScatter, Scatter
from .project.animation import LightCurve, ProjectCurve, Timeline
from .project.art import Art, Rule
from .project.backplate import Backplate, PlateSearch
from .project.camera import Camera
from .project.design import Bounds, Design, GhostTarget
from .project.holdout import Holdout
from .project.light import (
    D65,
    BlackBody,
    EqualEnergy,
    Light,
    LightKey,
    Lines,
    Polygon,
    Rectangle,
    Rgb,
    Spectrum,
    Tabulated,
)
from .project.look import Look
from .project.project import AsLens, CoatingChoice, Everywhere, InTurn, Output, PerRow, Preset, Project, Quality
from .project.starburst import Dirt, Starburst

__all__ = [
    "D65",
    "Art",
    "AsLens",
    "Backplate",
    "Bare",
    "BlackBody",
    "Bounds",
    "Camera",
    "Coating",
    "CoatingChoice",
    "Design",
    "Dirt",
    "Dispersion",
    "Element",
    "EqualEnergy",
    "Everywhere",
    "Figure",
    "Film",
    "GhostTarget",
    "Holdout",
    "Imperfection",
    "InTurn",
    "Iris",
    "Layer",
    "Lens",
    "Light",
    "LightCurve",
    "LightKey",
    "Lines",
    "Look",
    "Medium",
    "Output",
    "PerRow",
    "Plate",
    "PlateSearch",
    "Polygon",
    "Position",
    "Preset",
    "Project",
    "ProjectCurve",
    "Quality",
    "QuarterWave",
    "Rectangle",
    "Rgb",
    "Row",
    "RowScatter",
    "Rule",
    "Scatter",
    "SensorGrating",
    "Spectrum",
    "Stack",
    "Standard",
    "Starburst",
    "Stop",
    "Surface",
    "Tabulated",
    "Timeline",
]
