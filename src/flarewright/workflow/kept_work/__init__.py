"""Partial work of long commands, from which they resume.

- `checkpoints`: `checkpoints` stores the state of a long job every few seconds, `kept_until_done` until it is done
- `unnamed_work`: `unnamed_file`, the file with the partial work of a command without an output
- `kept_analysis`: `kept_analysis` keeps the finished part of a ghost analysis in a file
"""
