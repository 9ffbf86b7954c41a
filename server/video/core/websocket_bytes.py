"""A server's WebSocket messages as bytes (RFC 6455, 5.2): a head of two to ten bytes, and the payload. Pure.

Made once, the same bytes can be written to any number of connections.
"""

from typing import Final

TEXT: Final = 0x81
BINARY: Final = 0x82
"""Whole messages in one frame."""
PING: Final = bytes((0x89, 0))
"""A whole ping. The parser ignores its answer; its own pings have a payload."""
PONG: Final = bytes((0x8A, 0))
"""A whole unsolicited pong, which needs no answer (RFC 6455, 5.5.3)."""


def whole_message(first: int, payload: bytes) -> bytes:
    """`first`: TEXT (the payload is UTF-8) or BINARY."""
    size = len(payload)
    if size < 126:
        head = bytes((first, size))
    elif size < 1 << 16:
        head = bytes((first, 126, size >> 8, size & 0xFF))
    else:
        head = bytes((first, 127)) + size.to_bytes(8, "big")
    return head + payload


def payload_of(message: bytes) -> bytes:
    """Of a message that `whole_message` has made."""
    return message[{126: 4, 127: 10}.get(message[1], 2) :]
