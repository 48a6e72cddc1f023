"""Specifications of data sets: TOML that holds the distributions of training pairs (docs/datasets.md).

Relative paths (lenses, the folder of backgrounds) start at the file's folder.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from ...errors import FlarewrightError, ProjectError, raised_as
from ...model.project import dataset as records
from ...model.project import distribution as distributions
from ...model.project.dataset import DatasetSpec
from ..files.sentences import summary
from ..files.text_file import check_version
from ..files.type_slips import record_of
from ..lens.coating_text import parse_coating_choice
from .file_of_kind import read_file_of_kind
from .project_file import Sections, lens_location, validation_messages

_NEWEST = 1

_ANY = tuple(distributions.KINDS.values())
_SECTIONS: Sections = {
    "": (DatasetSpec,),
    "lens": (records.LensDraws,),
    "iris": (records.IrisDraws,),
    "dirt": (records.DirtDraws,),
    "scatter": (records.ScatterDraws,),
    "lights": (records.LightDraws,),
    "place": (records.InFrame, records.InField),
    "background": (records.BackgroundDraws,),
    "exposure": (records.ExposureDraws,),
    "sensor": (records.SensorDraws,),
    "masks": (records.MaskDraws,),
    "splits": (records.Splits,),
}
# keys that hold a distribution, whose own keys are suggested inside them
_SECTIONS |= {
    name: _ANY
    for kind in (model for models in list(_SECTIONS.values()) for model in models)
    for name in kind.model_fields
    if name not in _SECTIONS
}

EXAMPLE = """\
# Training pairs for the removal and the detection of lens flare; docs/datasets.md.
# A value is a number, a list of choices, or a distribution:
#   { choice = [2.8, 8.0], weights = [3, 1] }   { uniform = [0, 1] }    { log_uniform = [1, 100] }
#   { normal = [0, 1], bounds = [-2, 2] }       { integers = [5, 9] }
schema_version = 1
seed = 1
size_px = [512, 512]
quality = "draft"         # or "final": traced rays; then also: rings
layout = "webdataset"     # or "folder", "flare7k"
items_per_shard = 250
format = "png"            # or "png16", "jpeg", "exr"
light_in_clean = "core"   # or "image", "none"
# parts = ["clean", "flared", "ghosts", "starburst", "light_mask", "ghost_mask"]   # default: all

[lens]
names = ["heliar-tronnier", "takumar-50-f1.4", "flektogon-35", "nikkor-85-f1.4", "canon-70-200", "triplet-pestrecov"]
stops_down = { uniform = [0, 4] }   # or f_number
zoom = { uniform = [0, 1] }         # 0 is the shortest focal length, 1 the longest
coating = { choice = ["lens", "early-multicoat", "quarter-wave:550", "none"], weights = [4, 3, 2, 1] }
sensor_width_mm = 24.0

[iris]
blades = [0, 5, 6, 7, 8, 9]
rounding = { uniform = [0, 0.6] }
repeat = 25   # items in sequence that share an iris; its diffraction pattern takes a third of a second

[dirt]   # in the pupil; an item with dirt takes half a second longer
dust_per_mm2 = { choice = [0, 0.5], weights = [9, 1] }
scratches_per_cm2 = 0.0

[lights]
count = { choice = [1, 2, 3], weights = [6, 2, 1] }
place = { kind = "frame", margin = 0.1 }   # or "field", with x_deg and y_deg
stops = { normal = [0, 2], bounds = [-4, 4] }   # irradiance over pi times the mean luminance of the background
temperature_k = { log_uniform = [2700, 6500] }
diameter_deg = 0.0

[background]
# folder = "backgrounds"          # default: synthetic pictures
# crop = { uniform = [0.5, 1] }   # with a folder; also: flip

[exposure]
stops = { normal = [-0.5, 0.7], bounds = [-2, 1] }

[sensor]
full_well_e = { log_uniform = [2000, 40000] }
read_noise_e = { uniform = [1, 5] }
tone = "srgb"
# jpeg_quality = { integers = [75, 98] }

[masks]
ghosts = 8
threshold = 0.002

[splits]   # by lens: weights, or names
train = 4
val = 1
test = 1
"""
"""The file that `flarewright dataset --example` prints."""


def read_dataset_spec(path: str | os.PathLike[str]) -> DatasetSpec:
    """Read and check the specification of a data set.

    Parameters
    ----------
    path : path
        A TOML file.

    Returns
    -------
    DatasetSpec
        Relative paths are resolved from the file's folder.

    Raises
    ------
    ProjectError
        When the file cannot be read or has errors; `problems` then lists all of them, each with its place.

    Examples
    --------
    >>> from flarewright import read_dataset_spec
    >>> spec = read_dataset_spec("pairs.toml")                                          # doctest: +SKIP
    """
    path = Path(path)
    data = read_file_of_kind(path, "dataset", "a specification of a data set")
    return dataset_from_data(data, folder=path.parent, where=str(path))


def dataset_from_data(data: dict[str, Any], *, folder: Path, where: str) -> DatasetSpec:
    """Return the specification of parsed TOML; parameters and errors as `project_file.project_from_data`."""
    with raised_as(ProjectError):
        check_version(data, _NEWEST, f"the specification {where}")
    out = dict(data)
    table = out.get("background")
    if isinstance(table, dict) and isinstance(table.get("folder"), str):
        out["background"] = {**table, "folder": str(folder / table["folder"])}
    spec, problems = record_of(
        DatasetSpec.model_validate, out, lambda error: validation_messages(error, out, _SECTIONS)
    )
    if spec is not None:
        problems += _text_problems(spec, folder)
        problems += [*contradictions(spec), *_idle(spec)]
    if spec is None or problems:
        raise ProjectError(summary(where, problems), tuple(problems))
    return _resolved(spec, folder)


def _resolved(spec: DatasetSpec, folder: Path) -> DatasetSpec:
    """Return the specification with the paths of lens and coating files."""

    def place(names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(lens_location(name, folder) for name in names)

    def file(text: str) -> str:
        return str(folder / text.strip()) if text.strip().lower().endswith(".toml") else text

    names = spec.lens.names.replace(choice=place(spec.lens.names.choice))
    coating = spec.lens.coating.replace(choice=tuple(map(file, spec.lens.coating.choice)))
    splits = {name: place(part) for name, part in spec.splits if isinstance(part, tuple)}
    lens = spec.lens.replace(names=names, coating=coating)
    return spec.replace(lens=lens, splits=spec.splits.replace(**splits))


def _text_problems(spec: DatasetSpec, folder: Path) -> list[str]:
    """Return the errors of coating texts."""
    found = []
    for text in spec.lens.coating.choice:
        try:
            parse_coating_choice(text, folder=folder)
        except FlarewrightError as error:
            found.append(f"lens.coating: {error}")
    return found


def contradictions(spec: DatasetSpec) -> list[str]:
    """Return the settings of a specification that exclude each other, a sentence each."""
    sensor, found = spec.sensor, []
    if sensor.full_well_e is None and sensor.read_noise_e.support != (0.0, 0.0):
        found.append("sensor.read_noise_e needs sensor.full_well_e, the electrons at white")
    if spec.format != "exr" and not sensor.clip:
        found.append('sensor.clip = false needs format = "exr"; other files hold nothing above white')
    if spec.format == "exr" and sensor.tone.choice != ("linear",):
        found.append('format = "exr" holds linear light: write tone = "linear" in [sensor]')
    if spec.format in ("exr", "png16") and sensor.jpeg_quality is not None:
        found.append(f'sensor.jpeg_quality makes 8-bit pictures, not {spec.format}; choose format = "png" or "jpeg"')
    if spec.rings and spec.quality == "draft":
        found.append('rings = true needs quality = "final"; drafts have sharp edges')
    if spec.scatter is None and spec.parts is not None and "veil" in spec.parts:
        found.append("parts has veil, which needs [scatter]; add it, or leave veil out")
    if spec.layout == "flare7k" and spec.parts is not None:
        found.append("layout flare7k has its own parts; leave parts out")
    if spec.layout == "flare7k" and spec.format not in ("png", "jpeg"):
        found.append('layout flare7k has 8-bit pictures; choose format = "png" or "jpeg"')
    return found + _split_problems(spec)


def _idle(spec: DatasetSpec) -> list[str]:
    """Return the keys of a file that have no effect, a sentence each."""
    sensor, found = spec.sensor, []
    if spec.lens.f_number is not None and "stops_down" in spec.lens.model_fields_set:
        found.append("lens.f_number and lens.stops_down both set the aperture; keep one")
    if sensor.full_well_e is None and "noise" in sensor.model_fields_set:
        found.append("sensor.noise has no effect without sensor.full_well_e; give it, or leave noise out")
    if spec.layout != "webdataset" and "items_per_shard" in spec.model_fields_set:
        found.append(f"items_per_shard has no effect in layout {spec.layout}; leave it out")
    if spec.background.folder is None and (idle := spec.background.model_fields_set - {"folder"}):
        found.append(f"background.{min(idle)} has no effect without background.folder; give it, or leave both out")
    weighed = [name for name, part in spec.splits if isinstance(part, float) and name in spec.splits.model_fields_set]
    if any(isinstance(part, tuple) for _, part in spec.splits) and any(name != "train" for name in weighed):
        found.append("splits has names and weights; give names in all of them, or weights in all")
    return found


def _split_problems(spec: DatasetSpec) -> list[str]:
    """Return the errors of splits: names that are no lens of the set or that appear twice, and sums of nothing."""
    named = {name: part for name, part in spec.splits if isinstance(part, tuple)}
    known, found = spec.lens.names.choice, []
    for split, part in named.items():
        found += [f"splits.{split}: {name!r} is not among lens.names" for name in part if name not in known]
        for other, others in named.items():
            if other > split:
                found += [f"splits: {name!r} is in {split} and in {other}; keep one" for name in part if name in others]
    weighed = {name: part for name, part in spec.splits if isinstance(part, float)}
    if not named and not sum(weighed.values()) > 0.0:
        found.append("splits: all weights are 0; give one above 0")
    wanted = sum(part > 0.0 for part in weighed.values())
    if not named and wanted > len(known):
        found.append(f"{wanted} splits by lens need as many lenses; lens.names has {len(known)}")
    return found
