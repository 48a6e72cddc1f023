"""From the minima of a search to lenses that render: constraints, catalogue glasses, traced rays.

Public entry points: `candidate.outcomes`, `candidate.nearest_outcomes`, `lens_edits.resize_ghost`,
`lens_edits.resize_all`, `lens_edits.move_stop`.

- `candidate`: `Outcome` and `outcomes`: the best distinct lenses of a search, polished
- `constraints`: hard constraints: `breaches` measures violations, `keeps_limits` removes them
- `glass_rounding`: `with_catalogue_glasses` replaces free indices by catalogue glasses
- `null_space`: `lenses_with_same_ghosts`, and `to_the_middle`, which chooses the most moderate of them
- `traced`: `traced_ghosts`: place and size of ghosts by traced rays
- `traced_polish`: `finish` moves traced ghosts closer to their targets
- `lens_edits`: direct changes of a lens without a search
"""
