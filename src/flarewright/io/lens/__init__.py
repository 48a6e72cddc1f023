"""Lens files and the glass catalogue, and the text forms of coatings, plates and scatter.

`toml_lens.read_lens` reads a lens file of any format; `lens_writer.write_lens` writes our own TOML format.

- `codev`: `read_seq`, the `.seq` format of CODE V
- `coating_text`: `parse_coating`, `parse_coating_choice`, `format_coating`, `read_coating_file`
- `dotlens`: `read_dotlens`, the `.lens` format
- `glass_catalogue`: `by_name`, `nearest`, glasses with their dispersion formulas
- `lens_fields`: number fields with limits, units and descriptions
- `lens_schema`: `lens_json_schema`, the JSON Schema of our format
- `lens_writer`: `write_lens`, `format_lens`
- `library`: `library_names`, `lens_path`, the lenses that ship with the program
- `media`: `attach`, `complete_medium`, dispersions for the media of a prescription
- `medium_names`: `named_medium`, `numbered_medium`, media as other programs write them
- `optiland`: `read_optiland`, `optiland_text`, the lenses of Optiland
- `plate_text`: `parse_plate`, `parse_imperfection`, `parse_grating`
- `realflare`: `read_realflare`, the lenses of RealFlare
- `scatter_text`: the `[scatter]` table of a lens file
- `shape_fields`: aspheres, tilts, figure errors, elements and positions of a lens file
- `table_rows`: `sequence_of`, rows of simple tables
- `table_writer`: `csv_text`, `dotlens_text`
- `tables`: `read_csv_table`, `read_dat`, CSV and the lens tables of pbrt
- `toml_lens`: `read_lens`, `read_lens_toml`, `lens_from_table`
- `zemax`: `read_zmx`, the `.zmx` format and its glass names
- `zemax_configurations`: `configurations`, the settings that a `.zmx` file holds
- `zemax_keywords`: keywords that `zemax` uses, and those without effect
- `zemax_writer`: `zmx_text`, the `.zmx` format with positions as configurations
- `zemax_text`: lines of a `.zmx` file grouped by surface, encodings, decimal commas
"""
