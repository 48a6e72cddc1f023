"""The library of the user's lenses: one file a lens in a folder, and an index for searching.

- `archive`: `lens_files`, the lens files in a folder or a ZIP archive
- `facts`: `maker_of`, `patent_of`, found in the texts of a lens
- `folder`: `own_lenses`, where the files are, by name; `unused_name`, names that can be spoken and typed
- `index`: `read_index`, `write_index`, the records of all lenses in one file
- `record`: `LensRecord`, what is known of a lens, also in the first line of its file
- `search`: `Query`, `parse_range`, which lenses match words and ranges
"""
