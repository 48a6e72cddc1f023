"""A small lens whose ghosts tests look for."""

import numpy as np

from flarewright.design.objective import own_objective
from flarewright.design.prescription import structure_of, structures, vector_of
from flarewright.design.problem import Problem
from flarewright.model.design import Bounds
from flarewright.render.prepare import load_lens


def planted(*, signed=True, extra=500.0, begin=False):
    """The ghosts of a triplet, looked for among all lenses of six surfaces."""
    lens = load_lens("triplet-pestrecov")
    structure = structure_of(lens)
    vector = vector_of(lens, 6.0, 42.0)
    aim = own_objective(structure, vector, np.array([0.15]), bounds=Bounds(), signed=signed, extra=extra)
    found = structures(structure.rows - 1, len(structure.pairs))
    begin_with = ((structure, vector),) if begin else ()
    return Problem(aim, found, Bounds(), stop_diameter=6.0, begin_with=begin_with), structure, vector
