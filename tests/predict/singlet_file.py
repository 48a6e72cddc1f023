"""The lens with the fewest ghosts, as a file, for what does not depend on the lens."""

from pathlib import Path

SINGLET = """
schema_version = 1
name = "Singlet"
f_number = 5.0
rows = [
  { radius = 50.0, thickness = 5.0, n_d = 1.5168, v_d = 64.17, semi_diameter = 10.0 },
  { radius = -50.0, thickness = 2.0, semi_diameter = 10.0 },
  { stop = true, thickness = 80.0 },
]
"""


def singlet_file(folder: Path) -> str:
    """Write the lens into a folder and return its path."""
    path = folder / "singlet.toml"
    path.write_text(SINGLET)
    return str(path)
