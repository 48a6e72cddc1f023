"""Statement of a design problem: ghost targets, the lenses that a search may try, and the misfit between both.

A project becomes a `Problem`: an `Objective` (the targets), the `Structure`s (rows of glass and air) and their bounds.
Public entry points: `target.problem_of`, `impossible.obstacles`, `from_scratch.scratch_project`,
`photo_targets.seen_project`, `ghosts.placed_ghosts`.

- `target`: `problem_of` turns a project into a problem
- `problem`: `Problem` (input of every solver) and `LensCandidate` (a local minimum)
- `objective`: `Objective` and the misfit of a lens: `fitness`, `misfits`, and the algorithms of the thesis
- `prescription`: `Structure`, and a prescription as one vector
- `variables`: search variables, their bounds and random starting points
- `ghosts`: place, size and brightness of ghosts to first order, with derivatives
- `glass_list`: catalogue glasses that a design may use
- `rims`: semi-diameters that a designed lens needs
- `opening`: the f-number for a given stop diameter
- `impossible`: `obstacles` lists targets that no lens within the bounds can meet
- `reachable_range`: interval arithmetic behind `impossible`
- `from_scratch`: a project with random ghost targets and no lens to start from
- `photo_targets`: a project whose targets are ghosts seen in a picture
- `grey_picture`: ghosts drawn as in the thesis, PSNR and SSIM
- `target_image`: `TargetCanvas`, the target picture for a search by picture error
"""
