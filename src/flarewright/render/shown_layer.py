"""A layer of a finished render, which knows its picture and can show itself in a notebook."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..model import Layer, Project
from ..model.camera import Colorspace
from .compose import beauty


@dataclass(frozen=True)
class ShownLayer(Layer):
    """A layer and what is needed to look at it.

    Attributes
    ----------
    size_px : tuple of int or None
        Width and height of the whole picture; None: the smallest one from the origin that holds the window.
    colorspace : {"rec709", "acescg"}
        Of the pixels.
    """

    size_px: tuple[int, int] | None = None
    colorspace: Colorspace = "rec709"

    def _repr_png_(self) -> bytes:
        """Show the layer at its place in the picture, at an exposure found for this layer alone."""
        return self.png()

    def png(self, exposure_stops: float | None = None) -> bytes:
        """Return the layer at its place in the picture as the bytes of a PNG file.

        Parameters
        ----------
        exposure_stops : float, optional
            None: `render.display.auto_exposure` of this layer alone.

        Returns
        -------
        bytes
        """
        from ..io.png import encode_png
        from .display import view

        picture = beauty((self,), self.size_px).pixels
        return encode_png(view(picture, exposure_stops, "filmic", self.colorspace), {})


def shown_layers(layers: Sequence[Layer], project: Project) -> tuple[ShownLayer, ...]:
    """Return the layers of a project's picture so that they can be looked at."""
    size_px, colorspace = project.camera.size_px, project.output.colorspace
    return tuple(
        ShownLayer(layer.name, layer.pixels, layer.window, layer.about, size_px, colorspace) for layer in layers
    )
