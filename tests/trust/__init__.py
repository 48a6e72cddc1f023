"""The rig of hostile inputs: `python -m tests.trust --minutes N` (docs/promises.md)."""
