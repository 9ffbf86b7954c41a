"""`/.well-known/security.txt` (RFC 9116): contact for reports of vulnerabilities. Not found without a contact."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Final

PATH: Final = ".well-known/security.txt"
VALID_FOR: Final = timedelta(days=180)
"""Counted from each response: a tower that responds still has somebody who reads reports."""


def security_txt(contact: str, public_url: str, now: datetime) -> str | None:
    """`contact`: `mailto:` or `https:`. Returns None without a contact."""
    if not contact:
        return None
    lines = [f"Contact: {contact}", f"Expires: {now + VALID_FOR:%Y-%m-%dT%H:%M:%SZ}", "Preferred-Languages: en"]
    if public_url.startswith("https:"):
        lines.append(f"Canonical: {public_url}/{PATH}")
    return "\n".join(lines) + "\n"
