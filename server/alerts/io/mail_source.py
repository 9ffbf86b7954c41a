"""The setting that names the mail server."""

from __future__ import annotations

import re
from typing import Final, Literal
from urllib.parse import unquote, urlsplit

from server.alerts.io.mail import MailServer

MAIL_ADDRESS: Final = re.compile(r"[A-Za-z0-9.!#$%&'*+/=?^_`{|}~-]{1,64}@[A-Za-z0-9.-]{1,190}\.[A-Za-z]{2,63}")
_SECURITY: Final[dict[str, tuple[Literal["starttls", "tls", "none"], int]]] = {
    "smtp": ("starttls", 587),
    "smtps": ("tls", 465),
    "smtp+plain": ("none", 25),
}


def read_mail_server(text: str) -> MailServer:
    """`smtp://user@mail.example.org:587`. Raises ValueError."""
    parts = urlsplit(text)
    if parts.scheme not in _SECURITY or not parts.hostname or parts.path.strip("/") or parts.query or parts.fragment:
        raise ValueError("must look like smtp://user@mail.example.org:587 (or smtps://, or smtp+plain://)")
    if parts.password:
        raise ValueError("must not contain a password: set TOWER_MAIL_PASSWORD")
    security, port = _SECURITY[parts.scheme]
    return MailServer(parts.hostname, parts.port or port, security, unquote(parts.username or ""))


def read_mail_address(text: str) -> str:
    """Raises ValueError."""
    if not MAIL_ADDRESS.fullmatch(text):
        raise ValueError("must be an e-mail address")
    return text
