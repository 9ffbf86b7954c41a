"""The rule for names of users and drones: what is a valid name, and when two names are equal."""

from __future__ import annotations

import unicodedata
from typing import Final

from server.kernel.refusal import Refusal

MAX_NAME_LENGTH: Final = 64


class BadName(Refusal):
    """Not a valid name."""


def clean_name(text: str) -> str:
    """Returns `text` as stored: trimmed, NFC. Raises BadName unless it is 1..64 printable characters."""
    name = unicodedata.normalize("NFC", text).strip()
    if not name:
        raise BadName("a name must not be empty")
    if len(name) > MAX_NAME_LENGTH:
        raise BadName(f"a name has at most {MAX_NAME_LENGTH} characters")
    if not name.isprintable():
        raise BadName("a name must be printable characters only")
    return name


def is_name(text: str) -> bool:
    """Whether this is a valid name. Others need no lookup, and some databases fail on them."""
    try:
        clean_name(text)
    except BadName:
        return False
    return True


def name_key(name: str) -> str:
    """Two names are equal if their keys are: case and character width are ignored.

    The key is truncated to what the database stores, because folding can lengthen a name.
    """
    return unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", name).casefold())[:256]
