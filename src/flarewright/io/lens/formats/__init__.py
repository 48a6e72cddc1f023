"""Lens files of other programs than Zemax.

- `codev`: `read_seq`, the `.seq` format of CODE V
- `codev_words`: its command words
- `codev_zoom`: `positions`, its zoom positions
- `dotlens`: `read_dotlens`, the `.lens` format
- `optiland`: `read_optiland`, `optiland_text`, the lenses of Optiland
- `oslo`: `read_len`, the `.len` format of OSLO
- `oslo_configurations`: `configurations`, its configurations
- `realflare`: `read_realflare`, the lenses of RealFlare
- `table_rows`: `sequence_of`, rows of simple tables
- `table_writer`: `csv_text`, `dotlens_text`
- `tables`: `read_csv_table`, `read_dat`, CSV and the lens tables of pbrt
"""
