"""Helpers of the editor: background threads and the wording of error messages.

- `latest_job`: `Lane` runs the newest job on a thread
- `messages`: field names of the page, and one-sentence errors
"""
