"""Pack the Blender add-on into the one file that Blender installs.

    python tools/blender_addon.py -o flarewright-blender.zip

The same files always give the same bytes. Blender's own `blender --command extension build` makes such a file too.
"""

from __future__ import annotations

import argparse
import zipfile
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "bridges" / "blender"
# the first day that a ZIP file knows
_DATE = (1980, 1, 1, 0, 0, 0)


def pack(output: Path) -> list[str]:
    """Write the file, and return the names of what is in it.

    Parameters
    ----------
    output : path
    """
    files = sorted([*FOLDER.glob("*.py"), FOLDER / "blender_manifest.toml"])
    with zipfile.ZipFile(output, "w") as archive:
        for file in files:
            archive.writestr(zipfile.ZipInfo(file.name, _DATE), file.read_bytes(), zipfile.ZIP_DEFLATED)
        archive.writestr(zipfile.ZipInfo("LICENSE", _DATE), (FOLDER.parents[1] / "LICENSE").read_bytes())
    return [file.name for file in files]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("flarewright-blender.zip"))
    target = parser.parse_args().output
    print(f"{target}: {', '.join(pack(target))}")
