"""Commands of the user's library of lenses.

- `add`: add folders, ZIP archives and files
- `listing`: list the user's lenses
- `remove`: remove lenses
- `search`: search all lenses by words and numbers
- `show`: what is known of a lens, and where it came from
- `tables`: `print_records`, a table of records
- `thumbnails`: render the missing thumbnails
"""
