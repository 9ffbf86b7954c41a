"""The exceptions that end `tower connect` with a sentence. No other module may choose an exit code."""

from typing import ClassVar


class Ended(Exception):
    """Ended for an external reason: the controls were refused, or the tower was unreachable. The message is for
    people."""

    exit_code: ClassVar[int] = 1


class TowerAway(Ended):
    """The tower is unreachable at present."""


class Unusable(Ended):
    """An input is invalid, and a retry will not help: an option, the token, the drone's name, the port."""

    exit_code: ClassVar[int] = 2
