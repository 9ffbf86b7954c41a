"""Sends a short message to a browser through its push service (RFC 8030). Blocks."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass
from typing import Any, Final, Literal

from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, generate_private_key

from server.alerts.io.guarded_post import post
from server.alerts.io.message import Message, NotSent, SubscriptionGone
from server.alerts.io.push_encryption import SALT_BYTES, BrowserKeys, base64url, encrypt
from server.alerts.io.vapid import Vapid

MAX_TITLE: Final = 120
MAX_BODY: Final = 400
"""Characters; with six bytes for each (an escape in JSON) a message still fits into one record."""
_TOPIC_BYTES: Final = 24
"""As base64url the 32 characters that RFC 8030 allows."""


@dataclass(frozen=True, slots=True)
class Urgency:
    """`ttl_s`: how long the push service keeps it for a browser that is not there."""

    urgency: Literal["low", "normal", "high"]
    ttl_s: int


URGENCIES: Final = {
    "critical": Urgency("high", 4 * 3600),
    "warning": Urgency("normal", 3600),
    "notice": Urgency("low", 600),
}
_TEST: Final = Urgency("high", 60)
_OVER: Final = Urgency("normal", 4 * 3600)
"""The end is kept as long as the beginning, so that it replaces it, and wakes no sleeping telephone."""


def push(endpoint: str, keys: BrowserKeys, message: Message, vapid: Vapid, now_s: int, *, may_be_private: bool) -> None:
    """Raises NotSent unless the answer is 2xx, and SubscriptionGone if the browser has ended its subscription."""
    content = message.content
    urgency = _urgency(content)
    plain = json.dumps(note_of(message), ensure_ascii=False, separators=(",", ":")).encode()
    body = encrypt(plain, keys, ephemeral=generate_private_key(SECP256R1()), salt=os.urandom(SALT_BYTES))
    headers = {
        "Authorization": vapid.authorization(endpoint, now_s),
        "Content-Encoding": "aes128gcm",
        "Content-Type": "application/octet-stream",
        "TTL": str(urgency.ttl_s),
        "Urgency": urgency.urgency,
        "Topic": topic_of(message),
    }
    status = post(endpoint, body, headers, may_be_private=may_be_private)
    if status in (404, 410):
        raise SubscriptionGone("the browser has ended its subscription")
    if not 200 <= status < 300:
        raise NotSent(f"the push service answers {status}")


def note_of(message: Message) -> dict[str, str]:
    """What the service worker of the console reads (web/service_worker/alert_note.ts). `path`: of the console's page,
    below its address; `tag`: the same for all messages about one alert, of which the newest one is shown."""
    content = message.content
    if content["type"] != "alert":
        test = {"severity": "notice", "happening": "test", "tag": "test", "path": "#/account/alerts"}
        return {"title": message.subject, "body": _cut(content["words"], MAX_BODY), **test}
    severity = content["severity"]
    return {
        "title": _cut(message.subject, MAX_TITLE),
        "body": _cut(f"{severity.capitalize()}: {content['words']}", MAX_BODY),
        "severity": severity,
        "happening": content["happening"],
        "tag": f"alert-{content['id']}",
        "path": "#/admin/system" if content["drone"] is None else f"#/drone/{content['drone']['id']}",
    }


def topic_of(message: Message) -> str:
    """The newest message of a topic replaces those that the push service still keeps. All of an alert are one topic;
    the hash tells the push service nothing."""
    subject = message.content.get("id", "test")
    return base64url(hashlib.sha256(f"alert {subject}".encode()).digest()[:_TOPIC_BYTES])


def _urgency(content: Any) -> Urgency:
    if content["type"] != "alert":
        return _TEST
    return _OVER if content["happening"] == "closed" else URGENCIES[content["severity"]]


def _cut(text: str, length: int) -> str:
    return text if len(text) <= length else f"{text[: length - 1]}…"
