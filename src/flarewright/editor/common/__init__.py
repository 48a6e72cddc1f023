"""Helpers of the editor: background threads, free memory and the wording of error messages.

- `free_memory`: `release` gives free memory back to the system
- `latest_job`: `Lane` runs the newest job on a thread
- `light_names`: `light_label`, `with_light_names`: lights as the page names them
- `messages`: field names of the page, and one-sentence errors
"""
