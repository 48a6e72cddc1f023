"""A layer of a finished render that can show itself in a notebook."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...model import Layer, Project
from ...model.project.camera import Colorspace
from .compose import beauty


@dataclass(frozen=True)
class ShownLayer(Layer):
    """A layer with the data needed to display it.

    Attributes
    ----------
    size_px : tuple of int or None
        Width and height of the whole picture; None: the smallest picture from the origin that contains the window.
    colorspace : {"rec709", "acescg"}
        Of the pixels.
    """

    size_px: tuple[int, int] | None = None
    colorspace: Colorspace = "rec709"

    def _repr_png_(self) -> bytes:
        """Return a PNG of the layer within the picture, with its own exposure."""
        return self.png()

    def png(self, exposure_stops: float | None = None) -> bytes:
        """Return a PNG file of the layer within the picture, as bytes.

        Parameters
        ----------
        exposure_stops : float, optional
            None: `render.image.display.auto_exposure` of this layer alone.
        """
        from ...io.images.png import encode_png
        from .display import view

        picture = beauty((self,), self.size_px).pixels
        return encode_png(view(picture, exposure_stops, "filmic", self.colorspace), {})


def shown_layers(layers: Sequence[Layer], project: Project) -> tuple[ShownLayer, ...]:
    """Return the layers of a project's picture as `ShownLayer`."""
    size_px, colorspace = project.camera.size_px, project.output.colorspace
    return tuple(
        ShownLayer(layer.name, layer.pixels, layer.window, layer.about, size_px, colorspace) for layer in layers
    )
