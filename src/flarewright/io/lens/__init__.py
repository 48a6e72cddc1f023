"""Lens files and the glass catalogue, and the text forms of coatings, plates and scatter.

`toml_lens.read_lens` reads a lens file of any format; `lens_writer.write_lens` writes our own TOML format.

- `coating_text`: `parse_coating`, `parse_coating_choice`, `format_coating`, `read_coating_file`
- `configuration_table`: `settings`, what differs between the configurations of a file
- `foreign_file`: `decoded`, `number_of`, `lens_errors`, what readers of other programs' files share
- `formats`: lens files of CODE V, OSLO, RealFlare, Optiland and pbrt, `.lens` and CSV tables
- `glass_catalogue`: `by_name`, `nearest`, glasses with their dispersion formulas
- `lens_fields`: number fields with limits, units and descriptions
- `lens_schema`: `lens_json_schema`, the JSON Schema of our format
- `lens_writer`: `write_lens`, `format_lens`
- `library`: `library_names`, `lens_path`, lenses by name, shipped or of the user's library
- `own`: the user's library of lenses: folder, records, index, search
- `media`: `attach`, `complete_medium`, dispersions for the media of a prescription
- `medium_names`: `named_medium`, `numbered_medium`, `tabulated_medium`, media as other programs write them
- `plate_text`: `parse_plate`, `parse_imperfection`, `parse_grating`
- `scatter_text`: the `[scatter]` table of a lens file
- `shape_fields`: aspheres, tilts, figure errors, elements and positions of a lens file
- `toml_lens`: `read_lens`, `read_lens_toml`, `lens_from_table`
- `zemax`: the `.zmx` format
"""
