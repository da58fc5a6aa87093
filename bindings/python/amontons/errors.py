"""What the package raises. All other exceptions are Python's own."""

from typing import Any


class InputError(ValueError):
    """Bad input; nothing has run.

    issues: a list of dicts with file, place, found and allowed, one for each thing that is wrong.
    """

    issues: list = []


class SolveFailed(RuntimeError):
    """A step could not be solved. The simulation is as after the last accepted step.

    record: the last accepted step's, or None. summary: of run(), else None.
    """

    record: Any = None
    summary: Any = None
    time = 0.0
    step = 0


class WriteError(OSError):
    """A file could not be written; `filename` is it."""

    def __str__(self):  # OSError's own states only what it has a number for
        return str(self.args[0]) if len(self.args) == 1 else super().__str__()


class ModuleMissing(ImportError):
    """A part that is installed apart is not there; the message states what to install."""


class InternalError(RuntimeError):
    """A mistake in the engine, not in the input. Please report it."""
