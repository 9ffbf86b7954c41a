"""The rule for the names of users and drones: what is a name, and when two names are the same."""

from __future__ import annotations

import unicodedata
from typing import Final

from server.domain.refusal import Refusal

MAX_NAME_LENGTH: Final = 64


class BadName(Refusal):
    """Not a usable name."""


def clean_name(text: str) -> str:
    """`text` as it is stored: trimmed, composed. Raises BadName unless it is 1..64 printable characters."""
    name = unicodedata.normalize("NFC", text).strip()
    if not name:
        raise BadName("a name must not be empty")
    if len(name) > MAX_NAME_LENGTH:
        raise BadName(f"a name has at most {MAX_NAME_LENGTH} characters")
    if not name.isprintable():
        raise BadName("a name must be printable characters only")
    return name


def is_name(text: str) -> bool:
    """Whether anything can have this name. What cannot need not be looked for, and some databases choke on it."""
    try:
        clean_name(text)
    except BadName:
        return False
    return True


def name_key(name: str) -> str:
    """Two names are the same when their keys are: upper and lower case, wide and narrow letters do not count.

    The key is cut to what the database keeps: folding can make a name longer than it was.
    """
    return unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", name).casefold())[:256]
