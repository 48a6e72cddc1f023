"""Small films, encoded by PyAV directly: a lamp that moves over a grey ground."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

SIZE = (64, 36)
# matrix, primaries, transfer function and range of ITU-T H.273
BT709, BT601 = (1, 1, 1, 1), (5, 6, 6, 1)
LOSSLESS = {"qp": "0", "preset": "ultrafast"}


def lamp(k, size=SIZE):
    """Return the codes of a frame: a ground of 30, and a lamp that moves by a pixel each frame."""
    y, x = np.mgrid[: size[1], : size[0]] + 0.5
    codes = np.full((size[1], size[0], 3), 30, np.uint8)
    codes[np.hypot(x - 8 - k, y - 12) < 2] = (255, 250, 220)
    return codes


def write_sample(
    path, *, codec="libx264", pixels="yuv420p", frames=48, size=SIZE, rate=Fraction(24), tags=BT709, options=None,
    draw=lamp, moments=None, metadata=None, rotation=0, aspect=None,
):  # fmt: skip
    """Write a film."""
    import av

    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=rate, options=options or {})
        (stream.width, stream.height), stream.pix_fmt = size, pixels
        context = stream.codec_context
        context.colorspace, context.color_primaries, context.color_trc, context.color_range = tags
        context.time_base = 1 / rate
        if aspect is not None:
            context.sample_aspect_ratio = aspect
        if rotation:
            stream.set_display_rotation(rotation)
        container.metadata.update(metadata or {})
        for k in range(frames):
            frame = av.VideoFrame.from_ndarray(draw(k), format="rgb24").reformat(
                format=pixels, dst_colorspace={1: 1, 9: 9}.get(tags[0], 5), dst_color_range=tags[3] or 1
            )
            frame.colorspace, frame.color_range = tags[0], tags[3]
            frame.pts, frame.time_base = k if moments is None else moments[k], 1 / rate
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def write_codes(path, planes, pixels, tags, codec="ffv1"):
    """Write a lossless film of one frame with given codes of Y', Cb and Cr, each of shape (H, W)."""
    import av

    high, wide = planes[0].shape
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=24)
        stream.width, stream.height, stream.pix_fmt = wide, high, pixels
        context = stream.codec_context
        context.colorspace, context.color_primaries, context.color_trc, context.color_range = tags
        frame = av.VideoFrame(wide, high, pixels)
        for plane, codes in zip(frame.planes, planes, strict=True):
            rows = np.zeros((plane.height, plane.line_size // codes.itemsize), codes.dtype)
            rows[:, :wide] = codes
            plane.update(rows.tobytes())
        frame.colorspace, frame.color_primaries, frame.color_trc, frame.color_range = tags
        frame.pts, frame.time_base = 0, Fraction(1, 24)
        container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path
