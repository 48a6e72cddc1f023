"""Choice of coatings for target ghost colours (Van Acoleyen 2025, sections 5.3.6, 5.4 and 5.6.4).

A project becomes a `ColorProblem`; a solver returns `Coatings`. Public entry points: `colors.color_problem`,
`color_genes.colors_with`, `color_search.solve_colors`, `colors.coated`.

- `colors`: `ColorProblem`, `Coatings`, and ghost colours from surface reflectances
- `color_search`: `solve_colors`, the built-in solver (coordinate descent on tables, then Gauss-Newton)
- `color_genes`: `colors_with`, the same interface for every solver; coatings as genes
- `color_chart`: charts of the reflectance of quarter-wave coatings in R, G, B
"""
