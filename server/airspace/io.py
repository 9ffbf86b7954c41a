"""Reads the file of a network feed: from the disk or by http from a neighbour, bounded in size and time."""

from __future__ import annotations

import http.client
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

MAX_BYTES: Final = 4_000_000
WITHIN_S: Final = 2.0


def read_feed_address(text: str) -> str:
    """Raises ValueError with the reason."""
    if "://" not in text:
        if not Path(text).is_absolute():
            raise ValueError("must be an absolute path, or an http address")
        return text
    parts = urlsplit(text)
    if parts.scheme != "http" or not parts.hostname or parts.username is not None:
        raise ValueError("must be an absolute path, or an http address without a user")
    return text


def read_feed(address: str) -> bytes:
    """Blocks, for a few seconds at most. Follows no redirection. Raises OSError, ValueError."""
    if "://" not in address:
        with Path(address).open("rb") as file:
            return _bounded(file.read(MAX_BYTES + 1))
    parts = urlsplit(address)
    connection = http.client.HTTPConnection(parts.hostname or "", parts.port or 80, timeout=WITHIN_S)
    try:
        connection.request("GET", (parts.path or "/") + (f"?{parts.query}" if parts.query else ""))
        answer = connection.getresponse()
        if answer.status != http.client.OK:
            raise ValueError(f"the answer is {answer.status}")
        return _bounded(answer.read(MAX_BYTES + 1))
    except http.client.HTTPException as error:
        raise ValueError(f"no HTTP: {error!r}") from None
    finally:
        connection.close()


def _bounded(content: bytes) -> bytes:
    if len(content) > MAX_BYTES:
        raise ValueError(f"more than {MAX_BYTES} bytes")
    return content
