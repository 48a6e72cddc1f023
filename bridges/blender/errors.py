"""The error that a user sees."""


class FlareError(Exception):
    """An error of the scene or the settings; its text says what to do."""
