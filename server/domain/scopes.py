"""What an API token may be for. A person's own session is for everything; a token only for what it was made for."""

from __future__ import annotations

from enum import StrEnum
from typing import Final


class Scope(StrEnum):
    WATCH = "watch"
    """See the squad: drones, their frames, settings, checks."""
    FLY = "fly"
    """Have the controls and send what needs them."""
    ADMIN = "admin"
    """What only admins may do."""
    METRICS = "metrics"
    """Read the tower's metrics."""


ALL_SCOPES: Final = frozenset(Scope)
