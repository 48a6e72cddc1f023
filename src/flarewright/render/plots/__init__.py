"""Figures of reports, as SVG and pixels, without a plot library.

Modules:

- `svg`: `Chart` and its marks; `to_svg`, `chart_pixels`, `write_figure`
- `chart`: `chart`, `Series`: curves over an axis
- `coating_plot`: `coating_figure`: reflectance and colour of a coating
- `cross_section`: `cross_section`: a lens with rays, from the side
"""
