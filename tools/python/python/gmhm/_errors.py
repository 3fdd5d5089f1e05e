"""Exceptions and warnings. Their texts are those of the command line, whose options have the same names with dashes."""

from __future__ import annotations


class GmhmError(ValueError):
    """An input was rejected, or the work failed: what is wrong, where, and how to fix it."""

    def __init__(
        self,
        message: str,
        help: str | None = None,
        file: str | None = None,
        line: int | None = None,
        row: int | None = None,
        field: str | None = None,
    ) -> None:
        super().__init__(message, help, file, line, row, field)
        #: What is wrong, and where.
        self.message = message
        #: How to fix it, if the message does not say it.
        self.help = help
        #: The file or recording.
        self.file = file
        #: Its line, counted from 1.
        self.line = line
        #: Its row of numbers, counted from 1.
        self.row = row
        #: Its column or key.
        self.field = field

    def __str__(self) -> str:
        return self.message if self.help is None else f"{self.message}\nhelp: {self.help}"


class OptionError(GmhmError):
    """An argument has a value that it cannot have."""


class RecordingError(GmhmError):
    """A recording was rejected."""


class ModelError(GmhmError):
    """A model file was rejected."""


class PredictError(GmhmError):
    """Nothing could be predicted."""


class InvertError(GmhmError):
    """Nothing could be inverted."""


class FitError(GmhmError):
    """Nothing could be fitted."""


class DiagnoseError(GmhmError):
    """Nothing could be diagnosed."""


class HealthError(GmhmError):
    """A series could not be evaluated."""


class SimulateError(GmhmError):
    """Nothing could be simulated."""


class BlockError(GmhmError):
    """No block was made, or none could be read."""


class OutputError(GmhmError):
    """An output could not be written."""


class Note(UserWarning):
    """Information that is not a failure, such as interpolated dropouts."""
