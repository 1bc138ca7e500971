"""Exceptions; each message states the cause and the remedy."""

__all__ = ["FileError", "InputError", "MissingFileError"]


class InputError(ValueError):
    """Invalid input, or input that does not determine the requested result."""


class FileError(OSError):
    """A file could not be read."""


class MissingFileError(FileError, FileNotFoundError):
    """An absent file."""
