"""Specifications of data sets: TOML that holds the distributions of training pairs (docs/datasets.md).

Relative paths (lenses, the folder of backgrounds) start at the file's folder.
"""

from __future__ import annotations

import os
from pathlib import Path

from ...errors import FlarewrightError, ProjectError
from ...model.project import dataset as records
from ...model.project import distribution as distributions
from ...model.project.dataset import DatasetSpec
from ...sentences import summary
from ..files.type_slips import record_of
from ..lens.coating_text import parse_coating_choice
from .file_of_kind import read_file_of_kind
from .project_file import Sections, validation_messages
from .project_text import lens_location

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
    folder, out = path.parent, read_file_of_kind(path, "dataset")
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
        raise ProjectError(summary(str(path), problems), tuple(problems))
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
