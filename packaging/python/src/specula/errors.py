"""The errors of this package."""

from __future__ import annotations

import os

__all__ = ["SpeculaError", "ProgramNotFound", "FileError"]


class SpeculaError(Exception):
    """Every error of this package is one."""


class ProgramNotFound(SpeculaError):
    """There is no program `specula` to run."""


class FileError(SpeculaError, ValueError):
    """A file is damaged, truncated, or not what was expected; the message says where, and what was
    expected."""

    def __init__(self, path: str | os.PathLike[str], message: str) -> None:
        super().__init__(f"{os.fspath(path)}: {message}")
        self.path = path
