"""The exceptions that end `tower connect` with a sentence. No other module may choose an exit code."""

from typing import ClassVar


class Ended(Exception):
    """Over, for a reason outside: the controls were refused, the tower was not there. The message is for people."""

    exit_code: ClassVar[int] = 1


class TowerAway(Ended):
    """The tower cannot be reached at this moment."""


class Unusable(Ended):
    """Something given is wrong, and trying again will not help: an option, the token, the drone's name, the port."""

    exit_code: ClassVar[int] = 2
