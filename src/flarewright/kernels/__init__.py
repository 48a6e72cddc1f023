"""Kernels: the numerical core, compiled by Numba. Arrays in, arrays out; no other package of Flarewright compiles code.

Python calls kernels decorated with `jit.decorators.compiled`; only other kernels call those with `inner`, `borrowing`
or `inlined`. `jit/roots.json` lists the kernels that a first run compiles ahead.

- `jit`: decorators, compiler, on-disk cache, helper processes of a first run; no optics
- `tracing`: rays through surfaces, the adaptive grid of a bundle, clipping by rims and blades
- `paraxial`: ray transfer matrices along paths, and ghosts drawn from them
- `raster`: polygons with exact pixel coverage, bundles, iris patterns, display codes
- `diffraction`: starbursts and rings on pixels
- `scattering`: single scattering at surfaces, veiling glare
- `montecarlo`: the reference renderer's random rays
- `design`: paraxial ghosts with derivatives, and the local searches of the lens solvers
- `ghost_model`: measured ghosts: drawing, derivatives, normal equations, search
"""
