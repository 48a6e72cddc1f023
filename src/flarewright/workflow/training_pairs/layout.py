"""Names of an item's files in each layout, and the pictures that they hold."""

from __future__ import annotations

import json
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...io.images.exr import write_exr
from ...io.images.sample_png import encode_samples
from ...model import Layer
from ...model.project.dataset import DatasetSpec
from ...optics.colour.rgb import luminance_weights
from ...typing import Pixels
from .pictures import Pictures
from .sensor import PLAIN_QUALITY, codes, jpeg_bytes, through_jpeg

_SUFFIX = {"png": "png", "png16": "png", "jpeg": "jpg", "exr": "exr"}
# Flare7K's colours of a segmentation: glare, streak, light source
_GLARE, _STREAK, _SOURCE = (255, 255, 0), (255, 0, 0), (0, 0, 255)
_PHOTOGRAPHED = ("clean", "flared")


def key_of(index: int) -> str:
    """Return the name of an item, the same in all layouts; sorted names are in the order of the items."""
    return f"{index:08d}"


def item_files(spec: DatasetSpec, drawn: Pictures, digest: str) -> tuple[dict[str, bytes], bytes]:
    """Return the files of an item.

    Parameters
    ----------
    spec : DatasetSpec
    drawn : Pictures
    digest : str
        Of what made the data set.

    Returns
    -------
    files : dict of str to bytes
        By their names in the data set's folder, or in a tar file for WebDataset.
    record : bytes
        One line of JSON: all parameters, and size and SHA-256 of each file.
    """
    index = drawn.record["index"]
    contents = _flare7k(spec, drawn) if spec.layout == "flare7k" else _parts(spec, drawn)
    project = str(drawn.record["project"]).encode()
    files = {name_of(spec, drawn.split, index, part): data for part, data in contents.items()}
    files[name_of(spec, drawn.split, index, "project")] = project
    listed = {
        part: {"file": name_of(spec, drawn.split, index, part), "bytes": len(data), "sha256": sha256(data).hexdigest()}
        for part, data in {**contents, "project": project}.items()
    }
    record = {"key": key_of(index), "digest": digest, **drawn.record, "files": listed}
    return files, json.dumps(record, allow_nan=False, separators=(",", ":")).encode() + b"\n"


def name_of(spec: DatasetSpec, split: str, index: int, part: str) -> str:
    """Return the name of an item's file.

    Parameters
    ----------
    spec : DatasetSpec
    split : str
    index : int
    part : str
        A part, "project", "parameters", or a folder of Flare7K.
    """
    suffix = {"project": "toml", "parameters": "json"}.get(part, "png" if _is_mask(part) else _SUFFIX[spec.format])
    key = key_of(index)
    if spec.layout == "webdataset":
        # a key's extension is all after its first dot
        return f"{key}.{'json' if part == 'parameters' else part + '.' + suffix}"
    if spec.layout == "flare7k" and part not in ("project", "parameters"):
        return f"{part}/{key}.{suffix}"
    return f"{split}/{part}/{key}.{suffix}" if spec.layout == "folder" else f"{part}/{split}/{key}.{suffix}"


def _is_mask(part: str) -> bool:
    return part.endswith("mask")


def _parts(spec: DatasetSpec, drawn: Pictures) -> dict[str, bytes]:
    masks = {"light_mask": drawn.light_mask, "ghost_mask": drawn.ghost_mask}
    return {
        part: encode_samples(masks[part]) if part in masks else _encoded(spec, drawn, part, drawn.linear[part])
        for part in spec.drawn_parts
    }


def _flare7k(spec: DatasetSpec, drawn: Pictures) -> dict[str, bytes]:
    """Return the pictures by the folders of Flare7K (Dai et al. 2022, and the light sources of Flare7K++, 2023).

    The train split has flare alone, which its loader adds to backgrounds; the other splits are pairs.
    """
    light = drawn.linear
    if drawn.split != "train":
        base = {"val": "val", "test": "test_data/synthetic"}[drawn.split]
        return {
            f"{base}/input": _encoded(spec, drawn, "flared", light["flared"]),
            f"{base}/gt": _encoded(spec, drawn, "clean", light["clean"]),
            f"{base}/mask": encode_samples(_segmented(spec, drawn)),
        }
    scattering = "Flare7K/Scattering_Flare"
    pictures = {
        f"{scattering}/Compound_Flare": light["starburst"] + light["veil"],
        f"{scattering}/Light_Source": light["source"],
        f"{scattering}/Streak": light["starburst"] - light["source"],
        "Flare7K/Reflective_Flare": light["ghosts"],
    }
    if spec.scatter is not None:
        pictures[f"{scattering}/Glare_with_shimmer"] = light["veil"]
    return {folder: _encoded(spec, drawn, folder, picture) for folder, picture in pictures.items()}


def _segmented(spec: DatasetSpec, drawn: Pictures) -> NDArray[np.uint8]:
    """Return Flare7K's mask: where the flare exceeds the threshold, by the larger part of it."""
    weights = luminance_weights("rec709").astype(np.float32)
    streak = drawn.linear["starburst"] @ weights
    glare = (drawn.linear["ghosts"] + drawn.linear["veil"]) @ weights
    mask = np.zeros((*streak.shape, 3), np.uint8)
    seen = streak + glare >= spec.masks.threshold
    mask[seen & (streak >= glare)] = _STREAK
    mask[seen & (streak < glare)] = _GLARE
    mask[drawn.light_mask > 0] = _SOURCE
    return mask


def _encoded(spec: DatasetSpec, drawn: Pictures, part: str, linear: Pixels) -> bytes:
    """Return a picture as a file; only what the sensor recorded passes through JPEG."""
    sensor = drawn.sensor
    if spec.format == "exr":
        return _exr(spec, part, linear)
    if spec.format == "png16":
        return encode_samples(codes(linear, sensor.tone, 16))
    picture = codes(linear, sensor.tone, 8)
    quality = sensor.jpeg_quality if part in _PHOTOGRAPHED else None
    if spec.format == "jpeg":
        return jpeg_bytes(picture, quality or PLAIN_QUALITY)
    return encode_samples(picture if quality is None else through_jpeg(picture, quality))


def _exr(spec: DatasetSpec, part: str, linear: Pixels) -> bytes:
    wide, high = spec.size_px
    with TemporaryDirectory(prefix="flarewright-") as folder:
        path = Path(folder) / "picture.exr"
        layer = Layer(part.rpartition("/")[2], np.ascontiguousarray(linear, np.float32), (0, 0, wide, high))
        write_exr(path, [layer], spec.size_px, scale=1.0)
        return path.read_bytes()


def read_record(line: bytes) -> dict[str, Any] | None:
    """Return the record of an item; None if it is damaged."""
    try:
        record = json.loads(line)
    except ValueError:
        return None
    return record if isinstance(record, dict) and isinstance(record.get("files"), dict) else None
