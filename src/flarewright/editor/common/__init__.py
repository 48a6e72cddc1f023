"""Helpers of the editor: background threads, free memory and the wording of error messages.

- `free_memory`: `release` gives free memory back to the system
- `latest_job`: `Lane` runs the newest job on a thread
- `messages`: field names of the page, and one-sentence errors
"""
