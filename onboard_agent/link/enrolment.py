"""`tower-agent enrol`: makes the drone's key and registers its public half at the tower with a one-time token.

The key is on the disk before the tower receives its public half, and the tower accepts the same key twice. A lost
response, or an agent that is killed meanwhile, costs only another attempt.

It uses urllib because the agent does not depend on httpx. `httpx.Client` would add 8 MB and 0.12 s of CPU to a start of
40 MB and 0.41 s (one x86-64 core); websockets loads urllib.request anyway.
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
    """The tower does not respond. A later attempt may succeed."""


class _NoRedirects(urllib.request.HTTPRedirectHandler):
    """Follows no redirects, because the token is only for the tower that was named."""

    def redirect_request(self, *_: Any, **__: Any) -> None:
        return None


def enrol(tower: TowerUrl, token: str, path: Path) -> str:
    """Enrols this machine as the drone, stores its identity in `path` and returns the drone's name. Raises NotReached,
    or Unusable with the reason in one line, which never contains the token. `path` is unchanged until success."""
    draft = _draft_path(path)
    key = _key_for(draft, token)
    kept, drone = _register(tower, token, key)
    try:
        write_private(path, str(kept))
    except OSError as error:
        raise Unusable(f"the drone's key cannot be kept in {path}: {error.strerror}") from None
    with contextlib.suppress(OSError):
        draft.unlink()
    return drone


def check_can_keep(path: Path) -> None:
    """Creates the folder and checks that a file can be written there, before the token is spent. Raises Unusable."""
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        probe = path.with_name(f".{path.name}.{os.getpid()}")
        probe.unlink(missing_ok=True)
        os.close(os.open(probe, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
        probe.unlink()
    except OSError as error:
        raise Unusable(f"the drone's key cannot be kept in {path}: {error.strerror}; choose another --token") from None


def _draft_path(path: Path) -> Path:
    return path.with_name(f".{path.name}.enrolling")


def _key_for(draft: Path, token: str) -> DroneKey:
    """Returns the key that an earlier, interrupted process made for this token, or a new one."""
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


def _register(tower: TowerUrl, token: str, key: DroneKey) -> tuple[Kept, str]:
    """Returns the identity to store and the drone's name."""
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
    # Plain http must not leave this machine, even if the environment names a proxy.
    proxies = urllib.request.ProxyHandler(None if tower.secure else {})
    opener = urllib.request.build_opener(_NoRedirects, proxies)
    try:
        with opener.open(request, timeout=TIMEOUT_S) as answer:
            document = json.loads(answer.read(MAX_ANSWER_BYTES))
        drone_id = DroneId(int(document["drone_id"]))
        kept = Kept(drone_id, DroneKey(drone_id, key.seed), tower_key=key_bytes(document["tower_key"]))
        return kept, str(document["drone"])
    except urllib.error.HTTPError as error:
        with error:
            if error.code >= 500:
                raise NotReached(f"{tower} is not ready (status {error.code}); try again") from None
            raise Unusable(f"{tower} refused the enrolment: {_detail(error)}") from None
    except (urllib.error.URLError, OSError) as error:
        reason = error.reason if isinstance(error, urllib.error.URLError) else error
        raise NotReached(f"{tower} cannot be reached: {reason}. Try again with the same token") from None
    except (ValueError, KeyError, TypeError, MalformedKey):
        raise Unusable(f"{tower} does not answer as a tower of this version does") from None


def _detail(error: urllib.error.HTTPError) -> str:
    try:
        document = json.loads(error.read(MAX_ANSWER_BYTES))
        return str(document.get("detail") or document["title"])
    except (ValueError, KeyError, TypeError, AttributeError, OSError):
        return f"status {error.code}"
