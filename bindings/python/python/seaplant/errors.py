"""What can go wrong; each message says what was found and what to do."""

__all__ = ["FileError", "InputError", "MissingFileError"]


class InputError(ValueError):
    """What was given is wrong, or does not determine what was asked for."""


class FileError(OSError):
    """A file could not be read."""


class MissingFileError(FileError, FileNotFoundError):
    """There is no such file."""
