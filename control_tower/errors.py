"""What goes wrong for a program. Everything here derives from TowerError."""

from __future__ import annotations

from control_tower.values import Loss, Operation


class TowerError(Exception):
    """Base of all errors of this package. The message is for people."""


class TowerUnreachable(TowerError):
    """The tower does not answer at present. A retry may help."""


class SignInRefused(TowerError):
    """The tower does not accept the token, or has ended it. A retry does not help."""


class Refused(TowerError):
    """The tower refuses a request. `code` names the problem for programs (docs/api.md), such as `not-in-control`."""

    def __init__(self, status: int, code: str, words: str) -> None:
        super().__init__(words)
        self.status = status
        self.code = code


class OperationFailed(TowerError):
    """The drone did not do the work: it refused, failed, was interrupted, or did not answer in time."""

    def __init__(self, operation: Operation) -> None:
        super().__init__(operation.words or f"{operation.work}: {operation.state}")
        self.operation = operation


class FlightTimeout(TowerError):
    """The drone accepted the command but was not seen where it should be in time."""


class ControlLost(TowerError):
    """The program does not fly the drone any more: TAKE, a hold, or a lost link. Ends the `fly` context."""

    def __init__(self, loss: Loss) -> None:
        super().__init__(loss.words)
        self.loss = loss


class TooSlow(TowerError):
    """The program reads events more slowly than they come, and some were lost."""
