"""Writes to one browser what its outbox has due. Uses plain callbacks: waking a task costs more than a frame.

Frames are written at the end of the round (`write_round`) in which they arrived, in one message with all others of that
round, of one drone or of fifty. The state of drones that are only watched is written at the watch rate.
"""

import asyncio
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Final, Protocol

from server.link.api.write_round import WriteRound
from server.link.core.traffic import Traffic
from server.live.browser import Browser
from server.live.live_messages import Lost, ToBrowser, encode_event

MAX_FRAMES_PER_MESSAGE: Final = 128
"""Tower to browser; at most 36 KiB. A slow browser gets them one by one, and the socket's buffer stays small."""


class MessageWriter(Protocol):
    """What a writer needs of a connection; DirectWriter is one."""

    on_room: Callable[[], None]

    def has_room(self) -> bool:
        """False while the other side does not read."""

    def write_binary(self, payload: bytes) -> None:
        """Writes one binary message."""

    def write_text(self, payload: bytes) -> None:
        """Writes one text message, UTF-8."""


class LiveWriter:
    """Call `wake` whenever something may be due, `stop` at the end."""

    def __init__(self, browser: Browser, writer: MessageWriter, write_round: WriteRound, traffic: Traffic) -> None:
        self._browser = browser
        self._writer = writer
        self._round = write_round
        self._traffic = traffic
        self._due_since: float | None = None
        """When the first of the items that are due at once arrived; None while nothing is."""
        self._unsent_since: float | None = None
        """The same for the frames in `_unsent`."""
        self._loop = asyncio.get_running_loop()
        self._woken = False
        """A flush is scheduled, or the browser does not read: no need to schedule another."""
        self._stopped = False
        self._beat: asyncio.TimerHandle | None = None
        self._unsent: deque[Callable[[], int]] = deque()
        """Writes messages that were due when the browser stopped reading: at most those of one flush. They are encoded
        only then, because thousands at once would delay the frames. Each returns its bytes."""
        writer.on_room = self._flush
        browser.woken_by(self.wake)

    def wake(self) -> None:
        """Something is due, or a time for the next write is set."""
        if not self._woken:
            self._woken = True
            self._due_since = time.monotonic()
            self._round.ask(self._flush)

    def stop(self) -> None:
        """Stops writing and drops the references from the browser and the connection to this writer."""
        self._stopped = True
        self._browser.woken_by(_nothing)
        self._writer.on_room = _nothing
        self._unsent.clear()
        if self._beat is not None:
            self._beat.cancel()

    def _flush(self) -> None:
        if self._stopped:
            return
        writer, outbox, unsent, traffic = self._writer, self._browser.outbox, self._unsent, self._traffic
        now = time.monotonic()
        if not unsent and writer.has_room():
            for event in self._browser.take_events():
                if isinstance(event, Lost):
                    traffic.frames_lost += event.count
                unsent.append(partial(_write_event, writer, event))
            frames = outbox.take(now)
            traffic.frames_to_browsers += len(frames)
            self._unsent_since, self._due_since = self._due_since if frames else None, None
            for start in range(0, len(frames), MAX_FRAMES_PER_MESSAGE):
                unsent.append(partial(_write_frames, writer, frames[start : start + MAX_FRAMES_PER_MESSAGE]))
        while unsent and writer.has_room():
            traffic.bytes_to_browsers += unsent.popleft()()
            traffic.messages_to_browsers += 1
        if self._unsent_since is not None and not unsent:
            traffic.up.observe(time.monotonic() - self._unsent_since)
            self._unsent_since = None
        # Without room: until `on_room`. The outbox conflates meanwhile.
        self._woken = bool(unsent) or not writer.has_room()
        if self._woken and self._due_since is None:
            self._due_since = now  # nobody calls `wake` now: items count as if they arrived at once
        beat_at = None if self._woken else outbox.next_beat()
        if beat_at is not None and self._beat is None:
            self._beat = self._loop.call_later(max(0.0, beat_at - now), self._at_beat)

    def _at_beat(self) -> None:
        self._beat = None
        self._flush()


def _write_event(writer: MessageWriter, event: ToBrowser) -> int:
    message = encode_event(event).encode()
    writer.write_text(message)
    return len(message)


def _write_frames(writer: MessageWriter, frames: list[bytes]) -> int:
    message = b"".join(frames)
    writer.write_binary(message)
    return len(message)


def _nothing() -> None:
    pass
