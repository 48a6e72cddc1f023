"""Plain optical flow between two photographs: the baseline of a replay that needs no model.

Total variation and absolute differences (TV-L1): Zach, Pock and Bischof 2007, A duality based approach for realtime
TV-L1 optical flow; steps and pyramid as in Sanchez, Meinhardt-Llopis and Facciolo 2013 (IPOL).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates, median_filter, zoom

Floats = NDArray[np.float64]

# coupling and step of the dual variables, and numbers of warps at each size and of steps at each warp
_TIGHT, _STEP, _WARPS, _STEPS = 0.3, 0.25, 5, 30
# least side of the smallest picture, pixels
_LEAST_PX = 16


def optical_flow(one: Floats, other: Floats, weight: float = 10.0) -> Floats:
    """Return the motion from one picture to another, shape (2, H, W): pixels down and right.

    Parameters
    ----------
    one, other : ndarray, shape (H, W)
    weight : float
        Of differences of light, for pictures of unit contrast, against roughness of the motion.
    """
    contrast = max(float(np.std(one)), float(np.std(other)), 1e-12)
    pyramid = [(one / contrast, other / contrast)]
    while min(pyramid[-1][0].shape) >= 2 * _LEAST_PX:
        pyramid.append((_halved(pyramid[-1][0]), _halved(pyramid[-1][1])))
    flow = np.zeros((2, *pyramid[-1][0].shape))
    for here, there in reversed(pyramid):
        larger = np.array(here.shape) / flow.shape[1:]
        flow = np.stack([zoom(part, larger, order=1) * ratio for part, ratio in zip(flow, larger, strict=True)])
        flow = _refined(here, there, flow, weight)
    return flow


def warped(picture: Floats, flow: Floats) -> Floats:
    """Sample a picture, shape (H, W, ...), at an offset from each pixel."""
    at = np.indices(flow.shape[1:]) + flow
    channels = picture.reshape(*flow.shape[1:], -1)
    read = [map_coordinates(channels[..., m], at, order=1, mode="nearest") for m in range(channels.shape[2])]
    return np.stack(read, axis=-1).reshape(picture.shape)


def between(one: Floats, other: Floats, logs: tuple[Floats, Floats], part: float) -> Floats:
    """Interpolate two pictures, shape (H, W, 3), along the flow of their logarithms, shape (H, W) each.

    The motion at a pixel in between is the mean of the motion from the first picture and that back from the second.
    """
    flow = 0.5 * (optical_flow(*logs) - optical_flow(*logs[::-1]))
    return (1.0 - part) * warped(one, -part * flow) + part * warped(other, (1.0 - part) * flow)


def _refined(here: Floats, there: Floats, flow: Floats, weight: float) -> Floats:
    dual = np.zeros((2, 2, *here.shape))
    reach = weight * _TIGHT
    for _ in range(_WARPS):
        moved = warped(there, flow)
        slope = np.stack(np.gradient(moved))
        squares = (slope**2).sum(axis=0) + 1e-9
        constant = moved - here - (slope * flow).sum(axis=0)
        for _ in range(_STEPS):
            miss = constant + (slope * flow).sum(axis=0)
            # the least sum of absolute difference and distance, along the gradient
            data = flow - np.clip(miss / squares, -reach, reach) * slope
            flow = data + _TIGHT * np.stack([_divergence(each) for each in dual])
            steep = np.stack([_gradient(part) for part in flow])
            dual += _STEP / _TIGHT * steep
            dual /= np.maximum(1.0, np.sqrt((dual**2).sum(axis=1, keepdims=True)))
        flow = np.stack([median_filter(part, 3) for part in flow])
    return flow


def _gradient(values: Floats) -> Floats:
    out = np.zeros((2, *values.shape))
    out[0, :-1], out[1, :, :-1] = np.diff(values, axis=0), np.diff(values, axis=1)
    return out


def _divergence(dual: Floats) -> Floats:
    """Return the negative adjoint of `_gradient`."""
    out = np.zeros(dual.shape[1:])
    out[:-1] += dual[0, :-1]
    out[1:] -= dual[0, :-1]
    out[:, :-1] += dual[1, :, :-1]
    out[:, 1:] -= dual[1, :, :-1]
    return out


def _halved(picture: Floats) -> Floats:
    return np.asarray(gaussian_filter(picture, 0.8)[::2, ::2])
