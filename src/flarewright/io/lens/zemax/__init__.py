"""Sequential lens files of Zemax (`.zmx`).

- `reader`: `read_zmx`, the format and its glass names
- `configurations`: `configurations`, the settings that a file holds
- `keywords`: keywords that `reader` uses, and those without effect
- `text`: lines of a file grouped by surface, decimal commas
- `writer`: `zmx_text`, the format with positions as configurations
"""
