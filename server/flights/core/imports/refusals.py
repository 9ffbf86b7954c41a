"""Why a flight file of another program is not taken or not given out. Knows nothing of HTTP."""

from server.kernel.refusal import Refusal


class BadFlightFile(Refusal):
    """The file cannot be read as a flight, or not be stored. The words are for people."""


class UnknownImport(Refusal):
    """Never was, deleted, or of somebody else."""

    def __init__(self) -> None:
        super().__init__("there is no such imported flight")


class ImportsFull(Refusal):
    """The uploader, or the tower, has no room for another one. Nothing of others is removed for it."""
