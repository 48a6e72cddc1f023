"""Calibrate the camera: levels, noise and response from given values, the files' metadata and the photographs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from ...errors import FlarewrightError
from ...io.images.photo import Photo, open_photo
from ...model.measurement.capture import CameraNoise, Capture, Matrix3
from ...typing import Mask, Pixels
from ..core.sampling import evenly_spaced
from .exposure_check import refuse_contradiction
from .hdr_merge import Exposure
from .noise import Noise, Transfer, common_black, fit_transfer, noise_of, smooth, transfers
from .settings import CalibrationSettings, MergeSettings


@dataclass(frozen=True)
class CameraCalibration:
    """Camera calibration for merging.

    Attributes
    ----------
    camera : CameraNoise
        With all values known.
    black : ndarray, shape (3,) or (height, width, 3)
    black_noise : float
        Variance of the black image over that of a single reading in the dark.
    white : float
        Clipping level; infinite when nothing clips.
    response : ndarray, shape (height, width, 3), or None
    size_px : tuple of int
    samples : tuple of int
    step : float
    white_balance : tuple of float or None
        White balance of the camera; None when its files do not contain it.
    to_rec709 : tuple of 3 tuples of 3 float, or None
        As of `Photo`.
    block : int
        Side of the block of averaged pixels.
    side : int
        As of `Photo`.
    remarks : tuple of str
    """

    camera: CameraNoise
    black: Pixels
    black_noise: float
    white: float
    response: Pixels | None
    size_px: tuple[int, int]
    samples: tuple[int, int, int]
    step: float
    white_balance: tuple[float, float, float] | None
    to_rec709: Matrix3 | None
    block: int
    side: int
    remarks: tuple[str, ...]

    def exposure(self, photo: Photo, capture: Capture, ratio: float = 1.0) -> Exposure:
        """Return a photograph prepared for merging; `ratio` is its light over the one expected from time and ISO."""
        noise = noise_of(self.camera, capture.iso, self.step)
        floor = noise.floor * (1.0 + self.black_noise)
        red, green, blue = (Noise(noise.slope / n, floor / n) for n in self.samples)
        seconds = capture.exposure_s * capture.iso / self.camera.iso * ratio
        return Exposure(photo, seconds, (red, green, blue), self.black, self.white, self.response)


def calibrate(
    captures: Sequence[Capture], folder: Path, camera: CameraNoise, block: int = 1,
    settings: MergeSettings = MergeSettings(),
) -> CameraCalibration:  # fmt: skip
    """Determine the levels and the noise of the camera.

    Parameters
    ----------
    captures : sequence of Capture
    folder : Path
        Folder of their files.
    camera : CameraNoise
        Known values. They have priority, and dark frames must not contradict them.
    block : int
        As of `open_photo`.
    settings : MergeSettings

    Raises
    ------
    FlarewrightError
        When files cannot be read, differ in size, contradict the levels, or do not determine the noise.
    """
    lights = [one for one in captures if one.kind == "light"]
    photos = {one.file: open_photo(folder / one.file, camera.white_level, block) for one in captures}
    _same_size(photos)
    first = photos[lights[0].file]
    iso = Counter(one.iso for one in lights).most_common(1)[0][0]
    if camera.electrons_per_unit is None:
        camera = camera.replace(iso=iso)
    remarks: list[str] = []
    groups = _some_groups([one for one in lights if one.iso == iso], settings.calibration)
    white = _white(first, camera, [photos[group[-1].file] for group in groups], settings.calibration)
    _see_something([photos[group[0].file] for group in groups], white, settings.calibration)
    pairs = [
        (photos[a.file], photos[b.file], a.exposure_s / b.exposure_s) for group in groups for a, b in pairwise(group)
    ]
    darks = [photos[one.file] for one in captures if one.kind == "dark"]
    black = _black(first, camera, darks, pairs, white, remarks, settings.calibration)
    _levels_fit(
        camera, black, white, darks, [photos[group[k].file] for group in groups for k in (0, -1)], settings.calibration
    )
    black_noise = 1.0 / len(darks) if black.ndim == 3 else 0.0
    if np.isfinite(white):
        # the noise is measured from exposures of the same light, so their listed times must be right
        silent = (Noise(0.0, 0.0),) * 3
        for group in groups:
            shots = [Exposure(photos[a.file], a.exposure_s, silent, black, white) for a in group]
            refuse_contradiction(shots, settings=settings.exposures)
    known = camera
    if camera.electrons_per_unit is None or camera.read_noise is None:
        # the noise of another ISO is another one
        silent_ones = [photos[one.file] for one in captures if one.kind == "dark" and one.iso == iso]
        points = _points(pairs, black, white, first.samples, black_noise, settings.calibration) + _dark_points(
            silent_ones, first.samples, settings.calibration
        )
        known = fit_transfer(points, camera, first.step, settings.calibration)
        remarks.append(_noise_words(camera, known))
    level = float(black.reshape(-1, 3).mean())
    known = known.replace(black_level=level, white_level=white if np.isfinite(white) else None)
    response = _response(
        [photos[one.file] for one in captures if one.kind == "flat"], black, white, settings.calibration
    )
    return CameraCalibration(
        known, black, black_noise, white, response, first.size_px, first.samples, first.step, first.white_balance,
        first.to_rec709, block, first.side, tuple(remarks),
    )  # fmt: skip


def _same_size(photos: dict[str, Photo]) -> None:
    sizes = Counter(photo.size_px for photo in photos.values())
    if len(sizes) > 1:
        usual = sizes.most_common(1)[0][0]
        odd = next(photo for photo in photos.values() if photo.size_px != usual)
        raise FlarewrightError(
            f"{odd.path} has {odd.size_px[0]}x{odd.size_px[1]} pixels, most others have {usual[0]}x{usual[1]}: all "
            "photographs of a run are of one size"
        )


def _some_groups(lights: Sequence[Capture], settings: CalibrationSettings) -> list[list[Capture]]:
    """Return the exposures, shortest first, of a few constellations spread over the run."""
    groups: dict[tuple[float, float], list[Capture]] = {}
    for one in lights:
        groups.setdefault((one.roll_deg, one.constellation_deg or 0.0), []).append(one)
    every = [sorted(group, key=lambda one: one.exposure_s) for group in groups.values()]
    return evenly_spaced(every, settings.groups)


def _bands(photo: Photo, settings: CalibrationSettings) -> Iterator[tuple[int, int]]:
    """Yield some bands of rows, spread over the picture."""
    height = photo.size_px[1]
    rows = min(settings.rows, height)
    for low in np.unique(np.linspace(0, height - rows, min(settings.bands, -(-height // rows))).astype(int)):
        yield int(low), int(low) + rows


def _white(first: Photo, camera: CameraNoise, longest: Sequence[Photo], settings: CalibrationSettings) -> float:
    """Return the clipping level: the given one, or the largest value if many pixels have it."""
    if camera.white_level is not None:
        return camera.white_level
    top, pile = -np.inf, 0
    for photo in longest:
        for low, high in _bands(photo, settings):
            numbers = photo.rows(low, high)
            largest = float(numbers.max())
            if largest > top:
                top, pile = largest, 0
            pile += int((numbers == top).sum())
    if pile >= settings.pile:
        return min(top, first.white_level or np.inf)
    return first.white_level if first.white_level is not None else float("inf")


def _see_something(shortest: Sequence[Photo], white: float, settings: CalibrationSettings) -> None:
    """Raise when even the shortest exposures are clipped over most of the picture."""
    shares = [
        np.mean([(photo.rows(*band) >= white).any(axis=2).mean() for band in _bands(photo, settings)])
        for photo in shortest
    ]
    hopeless = sum(share > 0.5 for share in shares)
    if hopeless > 0.5 * len(shares):
        raise FlarewrightError(
            "the photographs are saturated over more than half of the picture even in the shortest exposure: add "
            "shorter exposures"
        )


def _black(
    first: Photo, camera: CameraNoise, darks: Sequence[Photo], pairs: Sequence[tuple[Photo, Photo, float]],
    white: float, remarks: list[str], settings: CalibrationSettings,
) -> Pixels:  # fmt: skip
    if darks:
        width, height = first.size_px
        picture = np.zeros((height, width, 3))
        for photo in darks:
            picture += photo.rows(0, height)
        picture /= len(darks)
        if len(darks) >= settings.darks_for_picture:
            return picture.astype(np.float32)
        return np.asarray(picture.mean(axis=(0, 1)), np.float32)
    if camera.black_level is not None:
        return np.full(3, camera.black_level, np.float32)
    if any(first.black_level) or first.step == 0.0 or first.samples[1] > first.samples[0]:
        return np.asarray(first.black_level, np.float32)
    found = common_black((
        (one.first, one.second, one.around, one.free)
        for short, long, _ in pairs for one in _compared(short, long, white, settings)
    ), settings)  # fmt: skip
    if found is None:
        remarks.append("the files hold no black level; 0 was used, give it in camera.json if it is another")
        return np.zeros(3, np.float32)
    remarks.append(f"black level {found:.2f}, from the common origin of exposures of the same light")
    return np.full(3, found, np.float32)


def _levels_fit(
    camera: CameraNoise, black: Pixels, white: float, darks: Sequence[Photo], lights: Sequence[Photo],
    settings: CalibrationSettings,
) -> None:  # fmt: skip
    """Raise when a black or white level contradicts the photographs."""
    level = float(black.reshape(-1, 3).mean())
    numbers = {
        photo.path: np.concatenate([photo.rows(*band).ravel() for band in _bands(photo, settings)]) for photo in lights
    }
    most = max(float(one.max()) for one in numbers.values())
    doubt = settings.levels_differ * ((white if np.isfinite(white) else most) - level)
    source = f"{darks[0].path}, a dark frame, has" if darks else "the black level is"
    if level >= white:
        raise FlarewrightError(
            f"{source} {level:g}, which is not below {white:g}, where the sensor clips: photograph dark frames with "
            "the cap on, or correct the levels in camera.json"
        )
    if darks and camera.black_level is not None and abs(level - camera.black_level) > doubt:
        raise FlarewrightError(
            f"{source} {level:g} where black_level is {camera.black_level:g}: photograph dark frames with the cap on, "
            "or correct black_level in camera.json or leave it out"
        )
    path, usual = min(((path, float(np.median(one))) for path, one in numbers.items()), key=lambda one: one[1])
    if usual < level - doubt:
        raise FlarewrightError(
            f"{source} {level:g}, which is more than most of {path} has ({usual:g}): correct black_level in "
            "camera.json, photograph dark frames with the cap on, or copy that file again if others are right"
        )
    if camera.white_level is not None and lights[0].step > 0.0 and most - level > settings.far_above * (white - level):
        raise FlarewrightError(
            f"white_level is {white:g}, but the photographs have numbers up to {most:g}, more than a sensor gives "
            "beyond clipping: correct white_level in camera.json or leave it out"
        )


@dataclass(frozen=True)
class _Compared:
    """Some rows of one channel of two exposures of the same light, as read."""

    first: Pixels
    second: Pixels
    around: Pixels
    free: Mask
    rows: tuple[int, int]
    channel: int


def _compared(short: Photo, long: Photo, white: float, settings: CalibrationSettings) -> Iterator[_Compared]:
    for low, high in _bands(short, settings):
        a, b = short.rows(low, high), long.rows(low, high)
        around = smooth(b, settings.level_side)
        # exclude values near white, whose noise is clipped, and neighbours of clipped pixels, whose means are wrong
        clipped = smooth((b >= white).astype(np.float32), settings.level_side)
        free = (a < 0.9 * white) & (b < 0.9 * white) & (clipped == 0.0)
        for c in range(3):
            yield _Compared(a[..., c], b[..., c], around[..., c], free[..., c], (low, high), c)


def _points(
    pairs: Sequence[tuple[Photo, Photo, float]], black: Pixels, white: float, samples: tuple[int, int, int],
    black_noise: float, settings: CalibrationSettings,
) -> list[Transfer]:  # fmt: skip
    found: list[Transfer] = []
    for short, long, ratio in pairs:
        bands = list(_compared(short, long, white, settings))
        for c in range(3):
            parts = [one for one in bands if one.channel == c]
            level = [black[one.rows[0] : one.rows[1], :, c] if black.ndim == 3 else black[c] for one in parts]
            first, second, around = (
                np.concatenate([(getattr(one, name) - dark).ravel() for one, dark in zip(parts, level, strict=True)])
                for name in ("first", "second", "around")
            )
            free = np.concatenate([one.free.ravel() for one in parts])
            # actual exposure times differ from nominal ones; the well-lit pixels give the actual ratio
            lit = free & (around > settings.lit * float(around[free].max(initial=0.0)))
            measured = float(first[lit].sum()) / float(second[lit].sum()) if lit.sum() > 1000 else ratio
            honest = measured if 0.8 < measured / ratio < 1.25 else ratio
            found += transfers(first, second, around, min(honest, 1.0), free, samples[c], black_noise, settings)
    return found


def _dark_points(
    darks: Sequence[Photo], samples: tuple[int, int, int], settings: CalibrationSettings
) -> list[Transfer]:
    """Compare pairs of dark frames, whose differences contain read noise only."""
    found = []
    for one, other in pairwise(darks):
        for c in range(3):
            differences = np.concatenate(
                [(one.rows(*band) - other.rows(*band))[..., c].ravel() for band in _bands(one, settings)]
            )
            spread = float(differences.var(ddof=1)) * samples[c]
            found.append(Transfer(0.0, 2.0, spread, differences.size))
    return found


def _response(flats: Sequence[Photo], black: Pixels, white: float, settings: CalibrationSettings) -> Pixels | None:
    """Return each pixel's response over the mean of its neighbourhood.

    Wider variation is kept: it is the vignetting of the direct image, which ghosts do not share.
    """
    if not flats:
        return None
    width, height = flats[0].size_px
    total = np.zeros((height, width, 3))
    for photo in flats:
        numbers = photo.rows(0, height)
        if float((numbers >= white).mean()) > settings.clipped_flat:
            raise FlarewrightError(
                f"{photo.path} is saturated, so it is no flat: photograph an evenly lit surface with a shorter exposure"
            )
        total += numbers - black
    around = smooth(total, settings.flat_side)
    if not (around > 0.0).all():
        raise FlarewrightError(
            f"{flats[0].path} is not brighter than black everywhere, so it is no flat: photograph an evenly lit surface"
        )
    return np.clip(total / around, 0.25, 4.0).astype(np.float32)


def _noise_words(before: CameraNoise, found: CameraNoise) -> str:
    words = []
    if before.electrons_per_unit is None:
        words.append(
            f"{found.electrons_per_unit:.3g} +- {found.electrons_per_unit_error or 0.0:.2g} electrons per unit"
        )
    if before.read_noise is None:
        words.append(f"read noise {found.read_noise:.3g} +- {found.read_noise_error or 0.0:.2g} electrons")
    return f"{' and '.join(words)} at ISO {found.iso:g}, found from the photographs"
