"""Where the tower takes the time of day from. Handed to `create_app`, so that a test can move it."""

from collections.abc import Callable
from datetime import UTC, datetime

Clock = Callable[[], datetime]
"""Answers the time of day, always with a time zone."""


def utc_now() -> datetime:
    return datetime.now(UTC)
