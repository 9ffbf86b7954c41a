"""Why an alert channel is not made or changed. Knows nothing of HTTP."""

from __future__ import annotations

from typing import Final

from server.kernel.refusal import Refusal, RetryLater

MAX_CHANNELS: Final = 5
"""Mail addresses and webhooks of a user."""
MAX_BROWSERS: Final = 10
"""Of a user."""


class UnknownAlertChannel(Refusal):
    """It does not exist, or belongs to another user. Deliberately does not say which."""

    def __init__(self) -> None:
        super().__init__("there is no such alert channel")


class TooManyAlertChannels(Refusal):
    def __init__(self) -> None:
        super().__init__(f"a user has at most {MAX_CHANNELS} mail addresses and webhooks: delete one first")


class TooManyBrowsers(Refusal):
    def __init__(self) -> None:
        super().__init__(f"a user has alerts in at most {MAX_BROWSERS} browsers: delete one first")


class BadAlertChannel(Refusal):
    """The address, the code or the kind is not accepted."""


class TooManyMessages(RetryLater):
    """Of tests and codes: they must not become a way to flood somebody."""

    def __init__(self, retry_after_s: float) -> None:
        super().__init__("too many tests and codes: wait a little", retry_after_s=retry_after_s)
