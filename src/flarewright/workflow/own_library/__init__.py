"""The user's library of lenses.

- `addition`: `add_lenses` adds the lens files of folders and archives
- `own_lenses`: `own_library`, records of the user's lenses; `remove_lens`
- `lens_record`: `record_of_lens` and `shipped_records`, what a library knows of a lens
- `thumbnails`: `make_thumbnails` renders thumbnails of the user's lenses
"""
