"""Writes to one browser what its outbox has due. Plain callbacks: waking a task costs more than a frame.

When: at once if nothing was written for PACE_S, otherwise when that time has passed. A frame that comes alone is not
held up; frames that come close together, of one drone or of fifty, share a message. Each message costs a system
call here and a wake-up there, whatever its size.
"""

import asyncio
import time
from collections import deque
from collections.abc import Callable
from typing import Final

from server.direct_websocket import DirectWriter
from server.relay.browser import Browser
from server.relay.live_messages import Lost, encode_event
from server.relay.traffic import Traffic

PACE_S: Final = 0.001
"""Between two messages to one browser: so much a frame may be held up, and 1,000 messages a second are the most."""

MOST_FRAMES_A_MESSAGE: Final = 128
"""Downwards; at most 36 KiB. A browser that is slow gets them one by one, and the socket's buffer stays small."""


class LiveWriter:
    """Call `wake` whenever something may be due, `stop` at the end."""

    def __init__(self, browser: Browser, writer: DirectWriter, traffic: Traffic) -> None:
        self._browser = browser
        self._writer = writer
        self._traffic = traffic
        self._due_since: float | None = None
        """When the first of what is due at once came; None while nothing is."""
        self._unsent_since: float | None = None
        """The same of the frames in `_unsent`."""
        self._loop = asyncio.get_running_loop()
        self._woken = False
        """A flush is on its way, or the browser does not read: it need not be asked for again."""
        self._stopped = False
        self._flushed_at = 0.0
        self._beat: asyncio.TimerHandle | None = None
        self._unsent: deque[tuple[Callable[[bytes], None], bytes]] = deque()
        """Messages that were due when the browser stopped reading: no more than one flush makes."""
        writer.on_room = self._flush

    def wake(self) -> None:
        """Something is due, or a beat is set."""
        if self._woken:
            return
        self._woken = True
        self._due_since = now = time.monotonic()
        wait_s = self._flushed_at + PACE_S - now
        if wait_s <= 0.0:
            self._loop.call_soon(self._flush)
        else:
            self._loop.call_later(wait_s, self._flush)

    def stop(self) -> None:
        """Nothing is written from here on."""
        self._stopped = True
        if self._beat is not None:
            self._beat.cancel()

    def _flush(self) -> None:
        if self._stopped:
            return
        browser, outbox, unsent, traffic = self._browser, self._browser.outbox, self._unsent, self._traffic
        now = self._flushed_at = time.monotonic()
        if not unsent and self._writer.has_room():
            for event in browser.take_events():
                if isinstance(event, Lost):
                    traffic.frames_lost += event.count
                unsent.append((self._writer.write_text, encode_event(event).encode()))
            frames = outbox.take(now)
            traffic.frames_to_browsers += len(frames)
            self._unsent_since, self._due_since = self._due_since if frames else None, None
            for start in range(0, len(frames), MOST_FRAMES_A_MESSAGE):
                unsent.append((self._writer.write_binary, b"".join(frames[start : start + MOST_FRAMES_A_MESSAGE])))
        while unsent and self._writer.has_room():
            write, message = unsent.popleft()
            write(message)
            traffic.messages_to_browsers += 1
            traffic.bytes_to_browsers += len(message)
        if self._unsent_since is not None and not unsent:
            traffic.up.observe(time.monotonic() - self._unsent_since)
            self._unsent_since = None
        # Without room: until `on_room`. The outbox conflates meanwhile.
        self._woken = bool(unsent) or not self._writer.has_room()
        if self._woken and self._due_since is None:
            self._due_since = now  # nobody calls `wake` now: what comes is counted as if it came at once
        beat_at = None if self._woken else outbox.next_beat()
        if beat_at is not None and self._beat is None:
            self._beat = self._loop.call_later(max(0.0, beat_at - now), self._at_beat)

    def _at_beat(self) -> None:
        self._beat = None
        self._flush()
