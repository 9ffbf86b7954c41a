"""The tower's source of the time of day. Passed to `create_app`, so that a test can control it."""

from collections.abc import Callable
from datetime import UTC, datetime

Clock = Callable[[], datetime]
"""Returns the time of day, always with a time zone."""


def utc_now() -> datetime:
    return datetime.now(UTC)
