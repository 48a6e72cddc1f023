"""A small lens whose ghosts are the targets of several tests."""

import numpy as np

from flarewright.design.problem.objective import own_objective
from flarewright.design.problem.prescription import structure_of, structures, vector_of
from flarewright.design.problem.problem import Problem
from flarewright.model.project.design import Bounds
from flarewright.render.scene.resolve import load_lens


def planted(*, signed=True, extra=500.0, begin=False):
    """Return a problem with the ghosts of a triplet as targets, among all lenses of six surfaces."""
    lens = load_lens("triplet-pestrecov")
    structure = structure_of(lens)
    vector = vector_of(lens, 6.0, 42.0)
    aim = own_objective(structure, vector, np.array([0.15]), bounds=Bounds(), signed=signed, extra=extra)
    found = structures(structure.rows - 1, len(structure.pairs))
    begin_with = ((structure, vector),) if begin else ()
    return Problem(aim, found, Bounds(), stop_diameter=6.0, begin_with=begin_with), structure, vector
