"""The audit trail as a chain of hashes: what is hashed and signed, byte for byte. Pure. docs/asvs.md and docs/audit.md
say what it proves.

The hash of an event is SHA-256 over the lines of `canonical`, each ended by a line feed. JSON has its keys sorted, no
spaces, and no escapes but those that it needs. Who it was stands there by name alone: the number goes with the account.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Final, Protocol

HASH_BYTES: Final = 32
BEGINNING: Final = bytes(HASH_BYTES)
"""The hash before the first event."""
_EVENT: Final = "control-tower audit event v1"
_HEAD: Final = "control-tower audit head v1"
_STUB: Final = "control-tower audit stub v1"


class Event(Protocol):
    """The columns of an audit event that count."""

    id: Any
    at: Any
    actor_name: Any
    action: Any
    drone_id: Any
    detail: Any
    address: Any
    request_id: Any


@dataclass(frozen=True)
class Run:
    """Events from number `first` to `last` that retention has removed. `previous`: the hash before the first of them;
    `hash`: that of the last."""

    first: int
    last: int
    previous: bytes
    hash: bytes


def canonical(number: int, previous: bytes, event: Event) -> bytes:
    """What the hash of an event is made of. `number`: its place in the chain."""
    at: datetime = event.at
    values = [
        _EVENT,
        str(number),
        previous.hex(),
        str(event.id),
        at.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ"),
        *(_json(one) for one in (event.actor_name, event.action, event.drone_id, event.detail)),
        *(_json(one) for one in (event.address, event.request_id)),
    ]
    return "".join(f"{one}\n" for one in values).encode()


def event_hash(number: int, previous: bytes, event: Event) -> bytes:
    return hashlib.sha256(canonical(number, previous, event)).digest()


def head_text(number: int, hash_: bytes, at: datetime) -> bytes:
    """What the tower signs once a day: the chain up to this event."""
    return f"{_HEAD}\n{number}\n{hash_.hex()}\n{_time(at)}\n".encode()


def stub_text(run: Run, at: datetime) -> bytes:
    """What the tower signs in place of events that it removes."""
    return f"{_STUB}\n{run.first}\n{run.last}\n{run.previous.hex()}\n{run.hash.hex()}\n{_time(at)}\n".encode()


def _time(at: datetime) -> str:
    return at.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ")


def _json(value: object) -> str:
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
