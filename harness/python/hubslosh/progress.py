"""The line on stderr that shows the progress of a long computation."""

import shutil
import sys
import time
from collections.abc import Callable
from typing import Any

# True shows a line on stderr, False shows none, None shows it only on a terminal and in a notebook.
# A function is called with each new line.
Progress = bool | Callable[[str], Any] | None


def is_watched() -> bool:
    """Return True if stderr is a terminal or the output of a notebook, where a user sees it."""
    return sys.stderr.isatty() or type(sys.stderr).__module__ == "ipykernel.iostream"


class Line:
    """A line on the terminal, or in a notebook, whose text is replaced as work proceeds."""

    def __init__(self, progress: Progress = None) -> None:
        show = is_watched() if progress is None else progress
        self._show = show if callable(show) else self._write if show else None
        self._width = 0
        self.start()

    def start(self) -> None:
        """Start the clock from which `left` estimates the remaining time."""
        self._started = time.monotonic()

    def left(self, share: float) -> float:
        """Return an estimate of the remaining time, s, if ``share`` of the work is done."""
        return (time.monotonic() - self._started) * (1 / share - 1)

    def show(self, text: str) -> None:
        """Replace the displayed text by ``text``."""
        if self._show is not None:
            self._show(text)

    def _write(self, text: str) -> None:
        text = text[: shutil.get_terminal_size((100, 24)).columns - 1]
        print(f"\r{text:{self._width}}", end="", file=sys.stderr, flush=True)
        self._width = len(text)

    def close(self) -> None:
        """Remove the line from the terminal or the notebook."""
        if self._width:
            print(f"\r{'':{self._width}}\r", end="", file=sys.stderr, flush=True)
            self._width = 0
