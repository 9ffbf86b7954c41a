"""Sends a file to the tower by HTTP: `PUT /api/v1/agent/files/{transaction}`, with the ticket of the link.

A separate thread sends the bytes, over the uplinks and with the trusted certificates of the control channel. A network
failure, or a tower that is not ready (status 5xx), leads to a retry; a refusal by the tower is final.

It uses http.client because the socket is already connected and bound to an uplink, and another thread shuts it down.
httpx accepts no open socket without a custom network backend. For its memory and start, see
onboard_agent/link/enrolment.py.
"""

import asyncio
import contextlib
import http.client
import json
import logging
import socket
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from onboard_agent import VERSION
from onboard_agent.link.tower_url import TowerUrl
from onboard_agent.sockets.connecting import Unreachable, connect_tcp
from onboard_agent.sockets.control_channel import trust
from onboard_agent.sockets.data_socket import ANY_UPLINK
from onboard_agent.transactions.file_sending import NotSent, Sending, Sent

_log = logging.getLogger(__name__)

PIECE_BYTES: Final = 32 * 1024
SILENCE_S: Final = 20.0
"""Timeout for a tower or network that takes no data."""
AGAIN_AFTER_S: Final = 2.0
MAX_ANSWER_BYTES: Final = 64 * 1024


class _Refused(Exception):
    """The tower refuses the file. The message gives the reason for a person."""


class _NotSignedIn(_Refused):
    """The tower does not know the ticket."""


class _Stopped(Exception):
    """The transfer was stopped."""


class TowerFileSender:
    """A FileSender. Create and use it inside one running event loop."""

    def __init__(
        self, url: Callable[[], TowerUrl], ticket: Callable[[], str], uplinks: Sequence[str] = (ANY_UPLINK,)
    ) -> None:
        """`url`, `ticket`: tower and ticket of the current link; an empty ticket without a link."""
        self._url = url
        self._ticket = ticket
        self._uplinks = (*uplinks, ANY_UPLINK) if len(uplinks) > 1 else (ANY_UPLINK,)
        self._state: Sending | Sent | NotSent = NotSent("nothing was to be sent")
        self._task: asyncio.Task[None] | None = None

    @property
    def state(self) -> Sending | Sent | NotSent:
        """State of the file that was begun last."""
        return self._state

    def begin(self, transaction_id: int, path: Path) -> None:
        """Starts to send a file, in place of any other."""
        self.stop()
        self._state = Sending(0)
        self._task = asyncio.create_task(self._send(transaction_id, path), name=f"file {transaction_id}")

    def stop(self) -> None:
        """Stops sending."""
        if self._task is not None:
            self._task.cancel()
            self._task = None

    async def _send(self, transaction_id: int, path: Path) -> None:
        said = ""
        while True:
            try:
                await self._try(transaction_id, path)
            except _Refused as refusal:
                self._state = NotSent(str(refusal))
                return
            except FileNotFoundError:
                self._state = NotSent("it is not on the disk any more")
                return
            except (Unreachable, OSError, http.client.HTTPException) as error:
                if str(error) != said:
                    said = str(error)
                    _log.warning("a file does not get through to the tower: %s; trying on", said)
                self._state = Sending(0)
                await asyncio.sleep(AGAIN_AFTER_S)
            else:
                self._state = Sent()
                return

    async def _try(self, transaction_id: int, path: Path) -> None:
        """Makes one attempt. _Refused is final; any other exception allows a retry."""
        ticket = self._ticket()
        if not ticket:
            raise OSError("there is no link to the tower")
        url = self._url()
        opened = await connect_tcp(url, self._uplinks)
        loop = asyncio.get_running_loop()

        def gone(done: int) -> None:
            loop.call_soon_threadsafe(self._report, attempt, done)

        attempt = _Attempt(url, ticket, opened, gone)
        thread = asyncio.create_task(asyncio.to_thread(attempt.put, transaction_id, path))
        try:
            await asyncio.shield(thread)
        except _NotSignedIn as refusal:
            if self._ticket() == ticket:
                raise
            raise http.client.HTTPException(str(refusal)) from None  # the ticket's link has ended meanwhile
        except asyncio.CancelledError:
            attempt.stop()
            with contextlib.suppress(_Refused, _Stopped, OSError, http.client.HTTPException):
                await thread
            raise

    def _report(self, attempt: "_Attempt", done: int) -> None:
        if not attempt.stopped.is_set() and isinstance(self._state, Sending):
            self._state = Sending(done)


class _Attempt:
    """One request, in its thread."""

    def __init__(self, url: TowerUrl, ticket: str, opened: socket.socket, gone: Callable[[int], None]) -> None:
        """`gone`: called in the thread with the number of bytes sent."""
        self.stopped = threading.Event()
        self._url = url
        self._ticket = ticket
        self._socket = opened
        self._gone = gone

    def stop(self) -> None:
        """Stops the request. Called from another thread."""
        self.stopped.set()
        with contextlib.suppress(OSError):
            # Not SSLSocket.shutdown, which drops its encryption first while the thread may be writing.
            socket.socket.shutdown(self._socket, socket.SHUT_RDWR)

    def put(self, transaction_id: int, path: Path) -> None:
        """Sends the file. Raises _Refused, _Stopped, OSError, HTTPException."""
        with self._socket, path.open("rb") as file:
            size = path.stat().st_size
            self._socket.settimeout(SILENCE_S)
            if self._url.secure:
                self._socket = trust().wrap_socket(self._socket, server_hostname=self._url.host)
            with contextlib.closing(http.client.HTTPConnection(self._url.host, self._url.port)) as connection:
                connection.sock = self._socket
                connection.putrequest("PUT", f"/api/v1/agent/files/{transaction_id}", skip_accept_encoding=True)
                connection.putheader("Authorization", f"Bearer {self._ticket}")
                connection.putheader("User-Agent", f"tower-agent/{VERSION}")
                connection.putheader("Content-Type", "application/octet-stream")
                connection.putheader("Content-Length", str(size))
                connection.endheaders()
                try:
                    done = 0
                    while piece := file.read(PIECE_BYTES):
                        if self.stopped.is_set():
                            raise _Stopped
                        connection.send(piece)
                        done += len(piece)
                        self._gone(done)
                except (BrokenPipeError, ConnectionResetError):
                    pass  # a tower that refuses the file responds before it has received all of it
                _judge(connection.getresponse())


def _judge(answer: http.client.HTTPResponse) -> None:
    body = answer.read(MAX_ANSWER_BYTES)
    if 200 <= answer.status < 300:
        return
    if answer.status >= 500 or answer.status in (408, 429):
        raise http.client.HTTPException(f"the tower answers with HTTP status {answer.status}")
    try:
        document = json.loads(body)
        why = str(document.get("detail") or document["title"]).rstrip(".")
    except (ValueError, KeyError, TypeError, AttributeError):
        why = f"HTTP status {answer.status}"
    raise (_NotSignedIn if answer.status == 401 else _Refused)(why[:200])
