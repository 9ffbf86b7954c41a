"""What is sent to a person outside of the console."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


class NotSent(Exception):
    """The other side did not accept it. The message is for people and contains no secret."""


class SubscriptionGone(NotSent):
    """The other side will never accept anything for this address again."""


@dataclass(frozen=True, slots=True)
class Message:
    """`key` is the same at each attempt: a receiver that knows it already has the message."""

    key: str
    subject: str
    text: str
    """For a person."""
    content: Mapping[str, Any]
    """For a program; JSON."""
