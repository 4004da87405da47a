"""A line of progress in terminals and notebooks."""

from __future__ import annotations

import sys
import time

WIDTH = 30
PATIENCE = 0.7


class Progress:
    """Shows a bar for what lasts. Written to stderr, which notebooks show below the cell."""

    def __init__(self, name: str, wanted: bool | None):
        self._name = name
        self._begun = time.monotonic()
        self._last = ""
        visible = _is_watched() if wanted is None else wanted
        self.callback = self._tell if visible else None

    def _tell(self, share: float, words: str) -> None:
        if time.monotonic() - self._begun < PATIENCE:
            return
        done = round(WIDTH * min(max(share, 0.0), 1.0))
        line = f"{self._name} [{'#' * done}{'.' * (WIDTH - done)}] {100 * share:3.0f} % {words}"[:110]
        if line != self._last:
            sys.stderr.write("\r" + line.ljust(len(self._last)))
            sys.stderr.flush()
            self._last = line

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self._last:
            sys.stderr.write("\r" + " " * len(self._last) + "\r")
            sys.stderr.flush()


def _is_watched() -> bool:
    """Whether stderr is a terminal or the output of a notebook cell."""
    if sys.stderr is None:
        return False
    if "ipykernel" in sys.modules:
        return True
    try:
        return sys.stderr.isatty()
    except (AttributeError, ValueError):
        return False
