"""Exceptions and warnings."""

from __future__ import annotations

from dataclasses import dataclass


class GearlashError(Exception):
    """Base of the errors of this package."""


class GearlashWarning(UserWarning):
    """Warnings about a model or a result."""


@dataclass(frozen=True)
class Diagnostic:
    """One error: place, found and expected values."""

    file: str | None
    """File or text in which it was found; None for trees made in Python."""
    line: int | None
    """Line, counted from 1."""
    column: int | None
    """Column in characters, counted from 1."""
    path: str
    """Dotted path, such as ``connections.mesh_1.element.half_gap``."""
    message: str
    """Found and expected values."""
    help: str | None
    """The next step, such as the nearest valid name."""


class ModelError(GearlashError, ValueError):
    """Errors in a model, a name or a setting: all that were found.

    ``str(error)`` shows each with its line of text. ``file``, ``line``, ``column``, ``path`` and ``message`` are those of the first.
    """

    def __init__(self, text: str, diagnostics: list[dict] | None = None):
        super().__init__(text)
        self.text = text
        #: All mistakes.
        self.diagnostics = [
            entry if isinstance(entry, Diagnostic) else Diagnostic(**entry)
            for entry in diagnostics or []
        ]

    def _first(self, key: str):
        return getattr(self.diagnostics[0], key) if self.diagnostics else None

    @property
    def file(self) -> str | None:
        """File of the first error."""
        return self._first("file")

    @property
    def line(self) -> int | None:
        """Line of the first error, counted from 1."""
        return self._first("line")

    @property
    def column(self) -> int | None:
        """Column of the first error, counted from 1."""
        return self._first("column")

    @property
    def path(self) -> str | None:
        """Dotted path of the first error."""
        return self._first("path")

    @property
    def message(self) -> str | None:
        """Error message without its place."""
        return self._first("message")

    def __str__(self) -> str:
        return self.text

    def __reduce__(self):
        return (ModelError, (self.text, self.diagnostics))


def refuse(path: str, message: str, help: str | None = None) -> ModelError:
    """An error found in Python, in the form of the others."""
    text = f"{path}: {message}" if path else message
    if help:
        text += f"; {help}"
    entry = {"file": None, "line": None, "column": None, "path": path, "message": message, "help": help}
    return ModelError(text, [entry])


def file_error(number: int | None, text: str, path: str) -> OSError:
    """The OSError of an error number, such as FileNotFoundError."""
    if number is None:
        return OSError(text)
    return OSError(number, text, path)


def missing(package: str, what: str, extra: str) -> ImportError:
    """Package to install for an optional feature."""
    return ImportError(f"{what} needs {package}: pip install {package}, or pip install 'gearlash[{extra}]'")
