"""`tower-agent enrol`: creates the drone's key, and sends the tower its public half with a one-time token.

The key is on disk before the tower learns it, and the tower accepts the same key twice: after a lost answer or a killed
agent, simply try again.

Why urllib and not httpx: httpx is not a dependency of the agent. `httpx.Client` would add 8 MB and 0.12 s of CPU to a
start of 40 MB and 0.41 s (one x86-64 core); websockets loads urllib.request anyway.
"""

import base64
import contextlib
import json
import os
import secrets
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any, Final

from onboard_agent.link.identity import Kept
from onboard_agent.link.identity_file import write_private
from onboard_agent.link.tower_url import TowerUrl
from onboard_agent.unusable import Unusable
from wire.drone_key import (
    KEY_BYTES,
    DroneKey,
    MalformedKey,
    enrolment_statement,
    key_bytes,
    key_text,
)
from wire.ids import DroneId

TIMEOUT_S: Final = 20.0
MAX_ANSWER_BYTES: Final = 64 * 1024


class NotReached(Unusable):
    """The tower does not answer. Time may cure it."""


class _NoRedirects(urllib.request.HTTPRedirectHandler):
    """The token is for the named tower only: redirects are not followed."""

    def redirect_request(self, *_: Any, **__: Any) -> None:
        return None


def enrol(tower: TowerUrl, token: str, path: Path) -> str:
    """Makes this machine the drone, and keeps that in `path`. The drone's name. Raises NotReached, or Unusable with the
    reason in one line, which never holds the token. What was in `path` before stays there until all is well."""
    draft = _draft(path)
    key = _begun(draft, token)
    kept, drone = _ask(tower, token, key)
    try:
        write_private(path, str(kept))
    except OSError as error:
        raise Unusable(f"the drone's key cannot be kept in {path}: {error.strerror}") from None
    with contextlib.suppress(OSError):
        draft.unlink()
    return drone


def check_can_keep(path: Path) -> None:
    """Before the token is spent: makes the folder and looks whether a file can be written there. Raises Unusable."""
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        probe = path.with_name(f".{path.name}.{os.getpid()}")
        probe.unlink(missing_ok=True)
        os.close(os.open(probe, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
        probe.unlink()
    except OSError as error:
        raise Unusable(f"the drone's key cannot be kept in {path}: {error.strerror}; choose another --token") from None


def _draft(path: Path) -> Path:
    return path.with_name(f".{path.name}.enrolling")


def _begun(draft: Path, token: str) -> DroneKey:
    """The key that was made for this token, by this process or one that was killed."""
    with contextlib.suppress(OSError, ValueError):
        for_token, seed = draft.read_text().split()
        if secrets.compare_digest(for_token, token):
            return DroneKey(DroneId(0), key_bytes(seed))
    seed = key_text(secrets.token_bytes(KEY_BYTES))
    try:
        write_private(draft, f"{token}\n{seed}\n")
    except OSError as error:
        raise Unusable(f"the drone's key cannot be kept beside {draft}: {error.strerror}") from None
    return DroneKey(DroneId(0), key_bytes(seed))


def _ask(tower: TowerUrl, token: str, key: DroneKey) -> tuple[Kept, str]:
    signature = key.sign(enrolment_statement(token, key.public))
    body = {
        "token": token,
        "public_key": key_text(key.public),
        "signature": base64.urlsafe_b64encode(signature).decode().rstrip("="),
    }
    request = urllib.request.Request(  # noqa: S310  # https, or loopback: parse_tower_url has seen to that
        f"{tower}/api/v1/enrol",
        data=json.dumps(body).encode(),
        headers={"Content-Type": "application/json"},
        method="POST",
    )
    # In the clear it may not leave this machine, whatever proxy the environment names.
    proxies = urllib.request.ProxyHandler(None if tower.secure else {})
    opener = urllib.request.build_opener(_NoRedirects, proxies)
    try:
        with opener.open(request, timeout=TIMEOUT_S) as answer:
            answered = json.loads(answer.read(MAX_ANSWER_BYTES))
        drone_id = DroneId(int(answered["drone_id"]))
        kept = Kept(drone_id, DroneKey(drone_id, key.seed), tower_key=key_bytes(answered["tower_key"]))
        return kept, str(answered["drone"])
    except urllib.error.HTTPError as error:
        with error:
            if error.code >= 500:
                raise NotReached(f"{tower} is not ready (status {error.code}); try again") from None
            raise Unusable(f"{tower} refused the enrolment: {_detail(error)}") from None
    except (urllib.error.URLError, OSError) as error:
        reason = error.reason if isinstance(error, urllib.error.URLError) else error
        raise NotReached(f"{tower} cannot be reached: {reason}. Try again with the same token") from None
    except (ValueError, KeyError, TypeError, MalformedKey):
        raise Unusable(f"{tower} gave an answer that is no tower's, or an older version's") from None


def _detail(error: urllib.error.HTTPError) -> str:
    try:
        document = json.loads(error.read(MAX_ANSWER_BYTES))
        return str(document.get("detail") or document["title"])
    except (ValueError, KeyError, TypeError, AttributeError, OSError):
        return f"status {error.code}"
