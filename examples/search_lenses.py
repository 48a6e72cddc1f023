"""Search lenses that move one ghost of a Heliar, and print how near the best one comes.

Usage: python search_lenses.py [SECONDS]
"""

import sys

import flarewright as fw
from flarewright.workflow import search_lenses


def main(seconds: float) -> None:
    """Print the best lens and the errors of its ghosts."""
    lens, light = "heliar-tronnier", (8.0, 0.0)
    ghost = fw.ghosts(fw.load_lens(lens), light, f_number=8.0).ghosts[0]
    name = f"{ghost.first_reflection}-{ghost.second_reflection}"
    project = fw.Project(
        lens=lens,
        f_number=8.0,
        lights=(fw.Light(field_deg=light),),
        design=fw.Design(ghost_targets=(fw.GhostTarget(ghost=name, move_mm=1.0),)),
    )
    found = search_lenses(project, time_s=seconds, seed=1, lenses=3, report=print)
    best = found.outcomes[0]
    print(
        f"{len(found.outcomes)} lenses after {found.state.searches} searches; the best has fitness {best.fitness:.3g}"
    )
    for target, (place, size) in zip(found.problem.objective.names, best.residuals, strict=True):
        print(f"  {target}: {place:+.3f} mm off in place, {size:+.3f} mm in size")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 and sys.argv[1].replace(".", "").isdigit() else 5.0)
