"""Draw training pairs for flare removal from Python, and read them as a training loop does.

Usage: python training_pairs.py [FOLDER]
"""

import json
import sys
import tarfile
import tempfile
from pathlib import Path

import flarewright as fw

ITEMS = 6
SPEC = fw.DatasetSpec.model_validate(
    {
        "seed": 3,
        "size_px": (128, 96),
        "lens": {"names": ["heliar-tronnier", "triplet-pestrecov"], "stops_down": {"uniform": [2, 5]}},
        "lights": {"stops": {"normal": [1, 1], "bounds": [-1, 3]}},
        "sensor": {"full_well_e": 10000, "read_noise_e": 3},
        "splits": {"train": ["heliar-tronnier"], "test": ["triplet-pestrecov"]},
    }
)


def main(folder: Path) -> None:
    """Write the data set into a folder, and list its brightest ghosts."""
    folder.mkdir(parents=True, exist_ok=True)
    folder = folder / "pairs"
    result = fw.dataset(SPEC, folder, items=ITEMS)
    print(f"{result.drawn} items drawn, {result.kept} kept: {result.splits}")
    for path in sorted(folder.glob("train-*.tar")):
        with tarfile.open(path) as archive:
            for name in archive.getnames():
                if name.endswith(".json"):
                    record = json.loads(archive.extractfile(name).read())
                    ghosts = ", ".join(f"{ghost['name']} in {ghost['box']}" for ghost in record["ghosts"][:2])
                    print(f"{record['key']}: f/{record['f_number']:.1f}, ghosts {ghosts or 'too faint'}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()))
