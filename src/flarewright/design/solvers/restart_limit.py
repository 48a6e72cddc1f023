"""The largest number of restarts, for files and for the command line, which imports no numbers."""

MOST_RESTARTS = 1000
"""Largest number of independent searches of one problem."""
