"""Frozen data without algorithms: lens, glass, coating, iris, light, camera, project."""

from .art import Art, Rule
from .camera import Camera
from .coating import Bare, Coating, Film, QuarterWave, Stack, Standard
from .design import Bounds, Design, GhostWish
from .figure import Figure
from .glass import Dispersion, Medium
from .grating import SensorGrating
from .holdout import Holdout
from .imperfection import Imperfection
from .iris import Iris
from .layer import Layer
from .lens import Element, Lens, Position, Row, Stop, Surface
from .light import D65, BlackBody, EqualEnergy, Light, LightKey, Lines, Polygon, Rectangle, Rgb, Spectrum, Tabulated
from .look import Look
from .plate import Plate
from .project import AsLens, CoatingChoice, Everywhere, InTurn, Output, PerRow, Preset, Project, Quality
from .scatter import RowScatter, Scatter
from .starburst import Dirt, Starburst

__all__ = [
    "D65",
    "Art",
    "AsLens",
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
    "GhostWish",
    "Holdout",
    "Imperfection",
    "InTurn",
    "Iris",
    "Layer",
    "Lens",
    "Light",
    "LightKey",
    "Lines",
    "Look",
    "Medium",
    "Output",
    "PerRow",
    "Plate",
    "Polygon",
    "Position",
    "Preset",
    "Project",
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
]
