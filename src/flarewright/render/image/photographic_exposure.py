"""The exposure of a real camera: shutter, f-number and ISO for a light of known illuminance."""

from __future__ import annotations

from math import log2

from ...errors import ProjectError

SUN_LUX = 100_000.0
"""Illuminance by the high sun in a clear sky on a plane that faces it, lx, rounded."""

GREY = 0.18


def photographic_stops(
    f_number: float, *, ev: float | None = None, shutter_s: float | None = None, iso: float = 100.0,
    lux: float = SUN_LUX,
) -> float:  # fmt: skip
    """Compute the exposure of a picture in which intensity 1 stands for a given illuminance.

    Parameters
    ----------
    f_number : float
        F-number of the render. The picture already contains its effect on the light, so only `ev` uses it.
    ev : float, optional
        Exposure value log2(N^2 / t); give either this or `shutter_s`.
    shutter_s : float, optional
        Exposure time t, seconds.
    iso : float
    lux : float
        Illuminance of a light of intensity 1 on a plane that faces it.

    Returns
    -------
    float
        Stops for `render.image.display.view`.

    Raises
    ------
    ProjectError
        Neither or both of `ev` and `shutter_s` are given, or a number is not positive.

    Notes
    -----
    ISO 12232, standard output sensitivity: an exposure of 10 / S lux seconds becomes 18 % of white. A meter with
    K = 12.5 exposes grey to pi / 4 * 12.5 / S = 9.8 / S (tests/render/image/test_photographic_exposure.py).

    Examples
    --------
    >>> round(photographic_stops(8.0, shutter_s=1 / 250, iso=100), 2)
    9.49
    """
    if (ev is None) == (shutter_s is None):
        raise ProjectError("a photographic exposure needs an exposure value or a shutter time, one of them")
    for name, value in (("shutter", shutter_s), ("iso", iso), ("lux", lux)):
        if value is not None and not 0.0 < value < float("inf"):
            raise ProjectError(f"{name} {value:g} is not above 0")
    seconds = f_number**2 / 2.0**ev if ev is not None else shutter_s
    assert seconds is not None
    return log2(GREY * lux * seconds * iso / 10.0)
