"""Why a log is not given out, nor taken. Knows nothing of HTTP: `server/http/problems.py` maps it."""

from server.kernel.refusal import Refusal


class UnknownLog(Refusal):
    def __init__(self) -> None:
        super().__init__("the tower does not have this log: fetch it from the drone first")


class BadCredential(Refusal):
    """Not an agent that is known."""


class NotAskedFor(Refusal):
    """Nobody waits for this file, or not any more."""

    def __init__(self) -> None:
        super().__init__("nobody waits for this file")


class FileNotTaken(Refusal):
    """No space left."""


class FileIncomplete(Refusal):
    """Less came than was promised, or more."""
