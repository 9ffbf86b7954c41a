"""Fetches a package from the tower, verifies it, unpacks it: in a thread, over the way of the other HTTP requests.

The signature is checked before the payload is read, and the payload's hash before anything is unpacked.
"""

import asyncio
import contextlib
import hashlib
import http.client
import json
import logging
import socket
import threading
from collections.abc import Callable, Sequence
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path
from typing import Final

from onboard_agent import VERSION
from onboard_agent.link.tower_url import TowerUrl
from onboard_agent.sockets.connecting import Unreachable, connect_tcp
from onboard_agent.sockets.control_channel import trust
from onboard_agent.sockets.data_socket import ANY_UPLINK
from onboard_agent.update.fetching import Fetched, Fetching, NotFetched
from onboard_agent.update.releases import NotInstalled, Releases
from wire.agent_update import (
    DISTRIBUTION,
    MAX_HEAD_BYTES,
    MAX_PACKAGE_BYTES,
    BadPackage,
    OpenedHead,
    check_signature,
    open_head,
)

PIECE_BYTES: Final = 64 * 1024
SILENCE_S: Final = 20.0
TRIES: Final = 3
AGAIN_AFTER_S: Final = 2.0
MAX_REFUSAL_BYTES: Final = 64 * 1024
_log = logging.getLogger(__name__)


class _Refused(Exception):
    """By the tower, or by us: final."""


class TowerUpdateInstaller:
    """An UpdateInstaller. `releases` None: there is no folder that lasts, and nothing can be installed. `on_switched`:
    the agent must start again."""

    def __init__(
        self,
        tower: Callable[[], TowerUrl],
        ticket: Callable[[], str],
        releases: Releases | None,
        release_keys: Sequence[str],
        *,
        on_trial: int | None,
        on_switched: Callable[[], None],
        uplinks: Sequence[str] = (ANY_UPLINK,),
    ) -> None:
        self._tower = tower
        self._ticket = ticket
        self._releases = releases
        self._uplinks = uplinks
        self._on_trial = on_trial
        self._on_switched = on_switched
        self._task: asyncio.Task[None] | None = None
        self._stopped = threading.Event()
        self.release_keys = tuple(release_keys)
        self.state: Fetching | Fetched | NotFetched = Fetching(0, 0)

    def begin(self, version: str) -> None:
        self.state, self._stopped = Fetching(0, 0), threading.Event()
        self._task = asyncio.create_task(self._work(version), name="update")

    def stop(self) -> None:
        self._stopped.set()
        if self._task is not None:
            self._task.cancel()

    def switch(self, version: str, transaction_id: int) -> None:
        assert self._releases is not None
        self._releases.begin_trial(version, transaction_id)
        _log.warning("the agent starts again as %s", version)
        self._on_switched()

    def pop_outcome(self) -> tuple[int, bool, str] | None:
        if self._on_trial is not None:
            transaction_id, self._on_trial = self._on_trial, None
            return transaction_id, True, f"The agent {VERSION} runs, and has linked with the tower."
        ended = None if self._releases is None else self._releases.pop_outcome()
        return None if ended is None else (ended.transaction, False, ended.words)

    async def _work(self, version: str) -> None:
        if self._releases is None:
            self.state = NotFetched("The agent has no folder for releases: give it one with `state`")
            return
        stopped = self._stopped
        for left in reversed(range(TRIES)):
            try:
                tower = self._tower()
                opened = await connect_tcp(tower, self._uplinks)
                await asyncio.to_thread(self._fetch, tower, opened, version, self._releases.incoming, stopped)
                await asyncio.to_thread(self._install, version, self._releases)
                self.state = Fetched()
                return
            except (_Refused, NotInstalled) as error:
                self.state = NotFetched(str(error))
                return
            except (OSError, http.client.HTTPException, Unreachable) as error:
                if not left:
                    self.state = NotFetched(f"The package did not arrive: {error}")
                    return
            await asyncio.sleep(AGAIN_AFTER_S)

    def _fetch(
        self, tower: TowerUrl, opened: socket.socket, version: str, target: Path, stopped: threading.Event
    ) -> None:
        with opened:
            opened.settimeout(SILENCE_S)
            if tower.secure:
                opened = trust().wrap_socket(opened, server_hostname=tower.host)
            with contextlib.closing(http.client.HTTPConnection(tower.host, tower.port)) as connection:
                connection.sock = opened
                headers = {"Authorization": f"Bearer {self._ticket()}", "User-Agent": f"tower-agent/{VERSION}"}
                connection.request("GET", f"/api/v1/agent/releases/{version}", headers=headers)
                answer = connection.getresponse()
                if answer.status != http.client.OK:
                    raise _refusal(answer)
                total = int(answer.getheader("Content-Length") or 0)
                if not 0 < total <= MAX_PACKAGE_BYTES:
                    raise _Refused("The package is too large")
                with target.open("wb") as file:
                    done = 0
                    while piece := answer.read(PIECE_BYTES):
                        if stopped.is_set():
                            raise _Refused("It was stopped")
                        file.write(piece)
                        done += len(piece)
                        self.state = Fetching(done, total)
                if done != total:
                    raise OSError(f"{done} of {total} bytes came")

    def _install(self, version: str, releases: Releases) -> None:
        package = releases.incoming
        try:
            head = verified(package, self.release_keys)
            if head.head.version != version:
                raise BadPackage(f"holds {head.head.version}, and {version} was ordered")
            missing = sorted(set(head.head.requires) - set(_present()))
            if missing:
                raise BadPackage(f"needs other packages ({', '.join(missing)[:200]}): install it by hand")
            releases.install(version, package)
        except (BadPackage, NotInstalled) as error:
            raise _Refused(f"The package {error}") from None
        finally:
            with contextlib.suppress(OSError):
                package.unlink()


def verified(package: Path, release_keys: Sequence[str]) -> OpenedHead:
    """Raises BadPackage unless a release key signed exactly this file."""
    with package.open("rb") as file:
        opened = open_head(file.read(MAX_HEAD_BYTES))
        check_signature(opened, release_keys)
        file.seek(opened.payload_at)
        hashed = hashlib.file_digest(file, "sha256").hexdigest()
    size = package.stat().st_size - opened.payload_at
    if (hashed, size) != (opened.head.payload_sha256, opened.head.payload_bytes):
        raise BadPackage("is not what was signed")
    return opened


def _present() -> list[str]:
    """What the installed agent needs, and therefore has."""
    try:
        return requires(DISTRIBUTION) or []
    except PackageNotFoundError:
        return []


def _refusal(answer: http.client.HTTPResponse) -> Exception:
    if answer.status >= 500 or answer.status in (408, 429):
        return http.client.HTTPException(f"the tower answers with HTTP status {answer.status}")
    try:
        document = json.loads(answer.read(MAX_REFUSAL_BYTES))
        why = str(document.get("detail") or document["title"]).rstrip(".")
    except (ValueError, KeyError, TypeError, AttributeError):
        why = f"HTTP status {answer.status}"
    return _Refused(f"The tower does not give the package: {why[:200]}")
