"""Flarewright: lens flare as physics.

>>> import flarewright as fw
>>> project = fw.Project(lens="heliar-tronnier", lights=[fw.Light(field_deg=(10, 5))])
>>> rendering = fw.render(project)                                      # doctest: +SKIP
>>> beauty = rendering.layers[0].pixels                                 # doctest: +SKIP

Names are imported when they are first used, so `import flarewright` costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ._version import __version__ as __version__
from .lazy import lazy_names

if TYPE_CHECKING:
    from .errors import FlarewrightError as FlarewrightError
    from .errors import GlassError as GlassError
    from .errors import LensError as LensError
    from .errors import OutputError as OutputError
    from .errors import ProjectError as ProjectError
    from .io.images.exr import write_exr as write_exr
    from .io.images.half import exr_scale as exr_scale
    from .io.lens.coating_text import parse_coating_choice as parse_coating_choice
    from .io.project.dataset_file import read_dataset_spec as read_dataset_spec
    from .io.project.look_file import read_look as read_look
    from .io.project.project_file import read_project as read_project
    from .measure.replay.measured_project import render_measured as render_measured
    from .model import D65 as D65
    from .model import Art as Art
    from .model import AsLens as AsLens
    from .model import Bare as Bare
    from .model import BlackBody as BlackBody
    from .model import Bounds as Bounds
    from .model import Camera as Camera
    from .model import Coating as Coating
    from .model import CoatingChoice as CoatingChoice
    from .model import Design as Design
    from .model import EqualEnergy as EqualEnergy
    from .model import Everywhere as Everywhere
    from .model import Film as Film
    from .model import GhostTarget as GhostTarget
    from .model import InTurn as InTurn
    from .model import Iris as Iris
    from .model import Layer as Layer
    from .model import Lens as Lens
    from .model import Light as Light
    from .model import LightCurve as LightCurve
    from .model import LightKey as LightKey
    from .model import Lines as Lines
    from .model import Look as Look
    from .model import Medium as Medium
    from .model import Output as Output
    from .model import PerRow as PerRow
    from .model import Polygon as Polygon
    from .model import Preset as Preset
    from .model import Project as Project
    from .model import ProjectCurve as ProjectCurve
    from .model import Quality as Quality
    from .model import QuarterWave as QuarterWave
    from .model import Rectangle as Rectangle
    from .model import Rgb as Rgb
    from .model import RowScatter as RowScatter
    from .model import Rule as Rule
    from .model import Scatter as Scatter
    from .model import Stack as Stack
    from .model import Standard as Standard
    from .model import Stop as Stop
    from .model import Surface as Surface
    from .model import Tabulated as Tabulated
    from .model import Timeline as Timeline
    from .model.project.dataset import DatasetSpec as DatasetSpec
    from .plates.settings import PlateSettings as PlateSettings
    from .render.analysis import ghosts as ghosts
    from .render.analysis import paraxial as paraxial
    from .render.render import Rendering as Rendering
    from .render.render import render as render
    from .render.scene.looks import look_of as look_of
    from .render.scene.looks import with_look as with_look
    from .render.scene.photographic_defaults import as_photographed as as_photographed
    from .render.scene.resolve import load_lens as load_lens
    from .workflow.shot import ShotResult as ShotResult
    from .workflow.shot import shot as shot
    from .workflow.training_pairs.run import DatasetResult as DatasetResult
    from .workflow.training_pairs.run import dataset as dataset

_HOMES = {
    ".errors": ("FlarewrightError", "GlassError", "LensError", "OutputError", "ProjectError"),
    ".model": (
        "D65", "Art", "AsLens", "Bare", "BlackBody", "Bounds", "Camera", "Coating", "CoatingChoice", "Design",
        "EqualEnergy", "Everywhere", "Film", "GhostTarget", "InTurn", "Iris",
        "Layer", "Lens", "Light", "LightCurve", "LightKey", "Lines", "Look", "Medium", "Output", "PerRow", "Polygon",
        "Preset", "Project", "ProjectCurve", "Quality", "QuarterWave", "Rectangle", "Rgb", "RowScatter", "Rule",
        "Scatter", "Stack", "Standard", "Stop", "Surface", "Tabulated", "Timeline",
    ),
    ".io.lens.coating_text": ("parse_coating_choice",),
    ".io.images.exr": ("write_exr",),
    ".io.project.dataset_file": ("read_dataset_spec",),
    ".io.project.look_file": ("read_look",),
    ".io.images.half": ("exr_scale",),
    ".io.project.project_file": ("read_project",),
    ".measure.replay.measured_project": ("render_measured",),
    ".model.project.dataset": ("DatasetSpec",),
    ".plates.settings": ("PlateSettings",),
    ".render.analysis": ("ghosts", "paraxial"),
    ".render.scene.looks": ("look_of", "with_look"),
    ".render.scene.photographic_defaults": ("as_photographed",),
    ".render.scene.resolve": ("load_lens",),
    ".render.render": ("Rendering",),
    ".workflow.shot": ("ShotResult", "shot"),
    ".workflow.training_pairs.run": ("DatasetResult", "dataset"),
    # The package itself, which may be called: a function of its name could not live beside it.
    "": ("render",),
}  # fmt: skip
_names, __getattr__, _ = lazy_names(__name__, _HOMES)

__all__ = ["__version__", *_names]  # noqa: PLE0604


def __dir__() -> list[str]:
    return sorted(__all__)
