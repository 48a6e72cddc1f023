"""From a `Project` to what the passes draw: lens state, iris, lights and art rules.

Modules:

- `resolve`: `open_lens`, `load_lens`, `check_opens`, `build`, `resolve_project`: a project with its lens built
  (`ResolvedProject`)
- `arguments`: `project_of`: a project from the arguments of `render`
- `opening`: `Opening`, `make_opening`: the iris as the kernels read it
- `shot`: `Shot`: one light, or one part of an area light, with everything the passes share
- `shots`: `make_shots`: the shots of all lights of a project
- `area_lights`: `motion`, `spread_border`: how a ghost spreads over the extent of a light
- `holdout`: `read_plates`, `seen_part`: the visible part of a light behind a holdout
- `between_wavelengths`: `lens_between`: the lens at more than the traced wavelengths
- `path_color`: `traced_spectrum`, `direct_flux`: colours of paths between the traced wavelengths
- `paraxial_place`: `ghost_frame`: position and size of a ghost from matrices
- `direct_image`: `direct_image`, `defocus_mm`, `traced_pupil`: the direct image of a light
- `pixel_place`: `field_angles_at`: the field angles whose direct image lies at a pixel
- `art_rules`: `resolve_art`: art direction as overrides per path and per pass
- `looks`: `with_look`, `look_of`, `demonstration`: apply a look to a project, or extract it from one
- `photographic_defaults`: `as_photographed`: plausible settings for lenses of the library
- `placement_remarks`: `outside_remarks`, `veil_remarks`: remarks on badly placed lights
- `memory_check`: `check_memory`, `spare_bytes`: raise `MemoryError` before layers exceed the memory
"""
