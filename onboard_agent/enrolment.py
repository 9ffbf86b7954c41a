"""`tower-agent enrol`: gives the tower a one-time token and keeps the credential that comes back."""

import json
import os
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any, Final

from onboard_agent.tower_url import TowerUrl
from onboard_agent.unusable import Unusable
from wire.credential import Credential, MalformedCredential, parse_credential

TIMEOUT_S: Final = 20.0
LARGEST_ANSWER_BYTES: Final = 64 * 1024


class _NoRedirects(urllib.request.HTTPRedirectHandler):
    """The token is for the tower that was named, and for nobody it points to."""

    def redirect_request(self, *_: Any, **__: Any) -> None:
        return None


def fetch_credential(tower: TowerUrl, token: str) -> tuple[Credential, str]:
    """The drone's credential and name. Raises Unusable with the reason in one line, which never holds the token."""
    request = urllib.request.Request(  # noqa: S310  # https, or loopback: parse_tower_url has seen to that
        f"{tower}/api/v1/enrol",
        data=json.dumps({"token": token}).encode(),
        headers={"Content-Type": "application/json"},
        method="POST",
    )
    # In the clear it may not leave this machine, whatever proxy the environment names.
    proxies = urllib.request.ProxyHandler(None if tower.secure else {})
    opener = urllib.request.build_opener(_NoRedirects, proxies)
    try:
        with opener.open(request, timeout=TIMEOUT_S) as answer:
            told = json.loads(answer.read(LARGEST_ANSWER_BYTES))
        return parse_credential(told["credential"]), str(told["drone"])
    except urllib.error.HTTPError as error:
        with error:
            raise Unusable(f"{tower} refused the enrolment: {_detail(error)}") from None
    except (urllib.error.URLError, OSError) as error:
        reason = error.reason if isinstance(error, urllib.error.URLError) else error
        raise Unusable(f"{tower} cannot be reached: {reason}. The token was not used; try again") from None
    except (ValueError, KeyError, TypeError, MalformedCredential):
        raise Unusable(f"{tower} gave an answer that is no tower's") from None


def check_can_keep(path: Path) -> None:
    """Before the token is spent: makes the folder and looks whether a file can be written there. Raises Unusable."""
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        probe = _beside(path)
        probe.unlink(missing_ok=True)
        os.close(os.open(probe, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
        probe.unlink()
    except OSError as error:
        raise Unusable(f"the credential cannot be kept in {path}: {error.strerror}; choose another --token") from None


def keep_credential(path: Path, credential: Credential) -> None:
    """For its owner only, and whole or not at all. Raises Unusable."""
    fresh = _beside(path)
    try:
        fresh.unlink(missing_ok=True)
        with os.fdopen(os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as out:
            out.write(f"{credential}\n")
            out.flush()
            os.fsync(out.fileno())
        fresh.replace(path)
    except OSError as error:
        raise Unusable(f"the credential cannot be kept in {path}: {error.strerror}") from None


def _beside(path: Path) -> Path:
    return path.with_name(f".{path.name}.{os.getpid()}")


def _detail(error: urllib.error.HTTPError) -> str:
    try:
        document = json.loads(error.read(LARGEST_ANSWER_BYTES))
        return str(document.get("detail") or document["title"])
    except (ValueError, KeyError, TypeError, AttributeError, OSError):
        return f"status {error.code}"
