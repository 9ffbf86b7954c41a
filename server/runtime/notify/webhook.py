"""Calls a webhook: POST of a JSON document with a signature. Blocks.

`X-Tower-Signature` is `v1=` and the hexadecimal HMAC-SHA256, under the channel's secret, of the time stamp
(`X-Tower-Timestamp`, seconds since 1970), a full stop, and the body. `X-Tower-Delivery` is the same at each attempt.
"""

from __future__ import annotations

import hashlib
import hmac
import http.client
import json
import threading
from typing import Final
from urllib.parse import urlsplit

from server.runtime.judged_connection import AddressRefused, AddressUnknown, JudgedConnection, judged_address
from server.runtime.notify.message import Message, NotSent

MAX_ANSWER_BYTES: Final = 4096
WITHIN_S: Final = 10.0
"""For each read."""
IN_ALL_S: Final = 20.0
"""For the whole call. Without it a server that sends a byte now and then keeps the thread for hours."""
_USER_AGENT: Final = "ControlTower/1 (alerts)"


def signature(secret: str, timestamp_s: int, body: bytes) -> str:
    """Returns the value of X-Tower-Signature."""
    signed = f"{timestamp_s}.".encode() + body
    return f"v1={hmac.new(secret.encode(), signed, hashlib.sha256).hexdigest()}"


def call_webhook(url: str, secret: str, message: Message, timestamp_s: int, *, may_be_private: bool) -> None:
    """Raises NotSent unless the answer is 2xx."""
    parts = urlsplit(url)
    host, is_tls = parts.hostname or "", parts.scheme == "https"
    port = parts.port or (443 if is_tls else 80)
    body = json.dumps(message.content, ensure_ascii=False).encode()
    headers = {
        "Content-Type": "application/json",
        "User-Agent": _USER_AGENT,
        "X-Tower-Delivery": message.key,
        "X-Tower-Timestamp": str(timestamp_s),
        "X-Tower-Signature": signature(secret, timestamp_s, body),
    }
    try:
        address = judged_address(host, port, may_be_private=may_be_private)
    except AddressUnknown:
        raise NotSent("the name of the server is not known") from None
    except AddressRefused:
        raise NotSent("the server is in a private network") from None
    connection = JudgedConnection(host, port, address, is_tls=is_tls)
    deadline = threading.Timer(IN_ALL_S, connection.cut)
    deadline.daemon = True
    deadline.start()
    try:
        connection.connect()
        connection.sock.settimeout(WITHIN_S)
        connection.request("POST", (parts.path or "/") + (f"?{parts.query}" if parts.query else ""), body, headers)
        with connection.getresponse() as answer:
            answer.read(MAX_ANSWER_BYTES)
    except (OSError, http.client.HTTPException, ValueError) as error:
        raise NotSent(f"the server cannot be reached ({type(error).__name__})") from None
    finally:
        deadline.cancel()
        connection.close()
    if connection.is_cut:
        raise NotSent("the other side is too slow")
    if not 200 <= answer.status < 300:
        raise NotSent(f"the server answers {answer.status}")
