"""`/.well-known/security.txt` (RFC 9116): to whom people tell of a weakness. Not there without a contact."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Final

PATH: Final = ".well-known/security.txt"
VALID_FOR: Final = timedelta(days=180)
"""Counted from each response: a tower that responds still has an operator."""


def security_txt(contact: str, public_url: str, now: datetime) -> str | None:
    """`contact`: `mailto:` or `https:`. None: there is none."""
    if not contact:
        return None
    lines = [f"Contact: {contact}", f"Expires: {now + VALID_FOR:%Y-%m-%dT%H:%M:%SZ}", "Preferred-Languages: en"]
    if public_url.startswith("https:"):
        lines.append(f"Canonical: {public_url}/{PATH}")
    return "\n".join(lines) + "\n"
