"""What a condition of an alert answers: the words if it holds, or that it does not, or that nobody knows."""

from collections.abc import Callable
from enum import Enum

from server.alerts.core.facts import Facts


class Not(Enum):
    """Why there is no finding."""

    SO = "not so"
    KNOWN = "not known"
    """Opens nothing and closes nothing: an alert about a drone that fell silent stays."""


Finding = str | Not
"""A sentence or two that name the drone, if the condition holds."""

Condition = Callable[[Facts, bool], Finding]
"""Takes the facts, and whether the alert is open: a value must come back further than the limit that it passed."""
