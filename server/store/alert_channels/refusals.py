"""Why an alert channel is not made or changed. Knows nothing of HTTP."""

from __future__ import annotations

from typing import Final

from server.domain.refusal import Refusal

MAX_CHANNELS: Final = 5
"""Per user."""


class UnknownAlertChannel(Refusal):
    """It does not exist, or belongs to another user. Deliberately does not say which."""

    def __init__(self) -> None:
        super().__init__("there is no such alert channel")


class TooManyAlertChannels(Refusal):
    def __init__(self) -> None:
        super().__init__(f"a user has at most {MAX_CHANNELS} alert channels: delete one first")


class BadAlertChannel(Refusal):
    """The address, the code or the kind is not accepted."""
