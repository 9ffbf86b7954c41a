"""The scopes of an API token. A session allows everything, a token only what it was created for."""

from __future__ import annotations

from enum import StrEnum
from typing import Final


class Scope(StrEnum):
    WATCH = "watch"
    """See the squad: drones, their frames, settings, checks."""
    FLY = "fly"
    """Have the controls and send what needs them."""
    ADMIN = "admin"
    """Actions that only admins may perform."""
    METRICS = "metrics"
    """Read the tower's metrics."""


ALL_SCOPES: Final = frozenset(Scope)


def scopes_in(text: str) -> frozenset[Scope]:
    """Reads names with spaces between, as the database has them. Ignores those that this version does not know."""
    names = text.split()
    return frozenset(scope for scope in Scope if scope.value in names)
