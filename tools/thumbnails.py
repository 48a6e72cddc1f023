"""Render the thumbnails of the library that ship with the package.

    python tools/thumbnails.py              # all of them, takes minutes
    python tools/thumbnails.py low-sun      # only those whose name contains this

`tests/render/test_gallery.py` (slow) fails when a thumbnail differs from what its lens or look renders.
"""

from __future__ import annotations

import sys

from PIL import Image

from flarewright.io.images.thumbnails import SIZE_PX, thumbnail_path
from flarewright.render.gallery import card_picture, cards

QUALITY = 88


def main() -> None:
    """Render and write."""
    words = sys.argv[1:]
    for card in cards():
        if not words or any(word in card.name for word in words):
            path = thumbnail_path(card.kind, card.name)
            path.parent.mkdir(exist_ok=True)
            Image.fromarray(card_picture(card, SIZE_PX)).save(path, quality=QUALITY)
            print(f"{path.name}: {path.stat().st_size} bytes", flush=True)


if __name__ == "__main__":
    main()
