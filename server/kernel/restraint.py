"""What admins do about a drone that sends more than its share: mute, limit or quarantine it. Pure.

Each measure includes the milder ones. The tower itself takes only those that leave the flight alone
(server/link/core/noise_watch.py).
"""

from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from typing import Final


class Measure(StrEnum):
    """From the mildest to the hardest."""

    MUTED = "muted"
    """Its texts, and alerts that are not critical, reach only whoever has the controls, and no channel."""
    LIMITED = "limited"
    """Its telemetry passes a few times a second."""
    QUARANTINED = "quarantined"
    """Its agent has no link and gets none. Its key stays good."""


LIMITING: Final = frozenset({Measure.LIMITED, Measure.QUARANTINED})


@dataclass(frozen=True)
class Restraint:
    measure: Measure
    reason: str
    by: str
    """The name of the admin."""
    by_admin: bool
    """An admin of the tower: an admin of its team may not lift it."""
    since: datetime
