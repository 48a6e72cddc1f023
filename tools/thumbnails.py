"""Render the small pictures of the library that ship with the package.

    python tools/thumbnails.py              # all of them, some minutes
    python tools/thumbnails.py low-sun      # only those whose name has this in it

`tests/render/test_gallery.py` (slow) tells when a picture is no longer what its lens or look gives.
"""

from __future__ import annotations

import sys

from PIL import Image

from flarewright.io.thumbnails import SIZE_PX, thumbnail_path
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
