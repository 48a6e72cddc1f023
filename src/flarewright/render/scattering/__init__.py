"""Scattered light and veiling glare.

Modules:

- `scatter_pass`: `scatter_of` tabulates what scatters, `render_scatter` draws it; also `check_scatter`, `scatter_facts`
  (summary and remarks), `without_scattered` (direct images minus scattered light), `gather` (scatter at given points)
- `veiling_glare`: `veiling_glare`: the veiling glare index of a lens
"""
