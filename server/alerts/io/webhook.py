"""Calls a webhook: POST of a JSON document with a signature. Blocks.

`X-Tower-Signature` is `v1=` and the hexadecimal HMAC-SHA256, under the channel's secret, of the time stamp
(`X-Tower-Timestamp`, seconds since 1970), a full stop, and the body. `X-Tower-Delivery` is the same at each attempt.
"""

from __future__ import annotations

import hashlib
import hmac
import json

from server.alerts.io.guarded_post import post
from server.alerts.io.message import Message, NotSent


def signature(secret: str, timestamp_s: int, body: bytes) -> str:
    """Returns the value of X-Tower-Signature."""
    signed = f"{timestamp_s}.".encode() + body
    return f"v1={hmac.new(secret.encode(), signed, hashlib.sha256).hexdigest()}"


def call_webhook(url: str, secret: str, message: Message, timestamp_s: int, *, may_be_private: bool) -> None:
    """Raises NotSent unless the answer is 2xx."""
    body = json.dumps(message.content, ensure_ascii=False).encode()
    headers = {
        "Content-Type": "application/json",
        "X-Tower-Delivery": message.key,
        "X-Tower-Timestamp": str(timestamp_s),
        "X-Tower-Signature": signature(secret, timestamp_s, body),
    }
    status = post(url, body, headers, may_be_private=may_be_private)
    if not 200 <= status < 300:
        raise NotSent(f"the server answers {status}")
