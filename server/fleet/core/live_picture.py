"""The interface of the live state (the hub) for accounts and fleet."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import datetime
from typing import Any, Protocol

from server.kernel.fleet import FleetSnapshot
from server.kernel.people import SignInId
from wire.ids import UserId


class LivePicture(Protocol):
    """Every method is plain and returns at once: no lock, no waiting."""

    def apply_fleet(self, snapshot: FleetSnapshot) -> None:
        """Takes over who exists, who owns what and who may come in. Called with growing revisions only."""

    def end_loans(self, at: datetime) -> bool:
        """Ends the loans whose time is over at `at`. Whether there was any."""

    def notify_admins_of_enrolment(self, enrolment: Mapping[str, Any]) -> None:
        """How an enrolment goes (an EnrolmentView as JSON), to every admin's live connections."""

    def end_sessions(self, session_ids: Iterable[SignInId]) -> None:
        """Closes the live connections of these sessions and tokens."""

    def end_user(self, user_id: UserId, why: str) -> None:
        """Closes every live connection of a user, and tells it why."""
