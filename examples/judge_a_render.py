"""Render one shot in reference and in final quality, and test whether they differ by more than chance.

Writes judged.png: the reference, the final picture, and their difference in standard errors: red where final quality is
brighter, blue where the reference is, grey where too few rays fell for a comparison.

Usage: python judge_a_render.py [FOLDER]
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

import flarewright as fw
from flarewright.render.image.display import auto_exposure, view


def main(folder: Path, size: tuple[int, int] = (160, 90), error: float = 0.02) -> None:
    """Render both ways into a folder, and print what is found."""
    folder.mkdir(parents=True, exist_ok=True)
    project = fw.Project(
        lens="double-gauss-tronnier",
        f_number=5.6,
        iris=fw.Iris(blades=7),
        lights=[fw.Light(field_deg=(8.0, 4.0))],
        camera=fw.Camera(size_px=size),
        quality=fw.Quality(mode="reference", reference_error=error),
        output=fw.Output(starburst=False),
    )
    reference = fw.render(project, ledger=True)
    final = fw.render(project.replace(quality=fw.Quality(mode="final", wavelengths=31)))
    layers = {layer.name: layer.pixels for layer in reference.layers}
    mean, variance = layers["ghosts"], layers["ghosts.variance"]
    drawn = np.zeros_like(mean)
    ghosts = next(layer for layer in final.layers if layer.name == "ghosts")
    x, y, w, h = ghosts.window
    drawn[y : y + h, x : x + w] = ghosts.pixels

    # green is closest to perceived brightness
    sampled = variance[..., 1] > 0.0
    z = np.zeros(mean.shape[:2])
    z[sampled] = (drawn - mean)[sampled, 1] / np.sqrt(variance[sampled, 1])
    # the error is reliable where many rays fell
    known = sampled & (np.sqrt(variance[..., 1]) < 0.3 * np.minimum(mean, drawn)[..., 1])
    rms = np.sqrt((z[known] ** 2).mean())
    print(f"{known.mean():.0%} of the pixels are known to 30 %; there the two differ by rms {rms:.2f} standard errors")
    print(f"all ghosts, final over reference: {drawn[..., 1].sum() / mean[..., 1].sum() - 1.0:+.2%}")
    if reference.ledger is not None:
        for line in reference.ledger.lines:
            print(f"{line.words:34s} {line.share:11.6%} +- {line.standard_error:.1e}")

    stops = auto_exposure(drawn, "rec709")
    # white is no difference, full red and full blue are four standard errors
    part = np.clip(z / 4.0, -1.0, 1.0)
    red, blue = 1.0 - np.maximum(-part, 0.0), 1.0 - np.maximum(part, 0.0)
    difference = (255.0 * np.stack([red, np.minimum(red, blue), blue], axis=-1)).astype(np.uint8)
    difference[~known] = 128
    panels = [view(mean, stops), view(drawn, stops), difference]
    Image.fromarray(np.concatenate(panels, axis=1)).save(folder / "judged.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()))
