"""Puts the STATUSTEXT messages of an autopilot together, which may arrive in chunks. Pure; takes `now`."""

from typing import Final, NamedTuple

from wire.frames import payload

CHUNK_BYTES: Final = 50
CHUNK_WAIT_S: Final = 3.0
"""A chunk that is missing after this time is lost."""
MAX_CHUNKS: Final = 6
_SEVERITY: Final = 0
_TEXT: Final = slice(1, 51)
_ID: Final = slice(51, 53)
_CHUNK: Final = 53


class StatusText(NamedTuple):
    """A whole text, or what came of it. `severity`: MAV_SEVERITY, 0 is the worst."""

    severity: int
    text: str


class StatusTexts:
    """For one drone. Keeps one unfinished text: chunks of two texts do not mix."""

    def __init__(self) -> None:
        self._severity = 0
        self._parts: list[bytes] = []
        self._id = 0
        self._next = 0
        self._began_at = 0.0

    def take(self, frame: bytes, now: float) -> list[StatusText]:
        """Takes a whole STATUSTEXT frame. Returns the texts that are complete, or will not be completed."""
        content = payload(frame).ljust(54, b"\0")
        severity, text = content[_SEVERITY], content[_TEXT].split(b"\0")[0]
        number, chunk = int.from_bytes(content[_ID], "little"), content[_CHUNK]
        goes_on = bool(self._parts) and number == self._id and chunk == self._next and chunk < MAX_CHUNKS
        done = [] if goes_on else self._given_up()
        if not goes_on:
            self._severity, self._id, self._next, self._began_at = severity, number, chunk, now
        self._parts.append(text)
        self._next += 1
        if number == 0 or len(text) < CHUNK_BYTES:
            done += self._given_up()
        return done

    def overdue(self, now: float) -> list[StatusText]:
        """Returns a text whose next chunk is lost."""
        return self._given_up() if self._parts and now - self._began_at > CHUNK_WAIT_S else []

    def _given_up(self) -> list[StatusText]:
        if not self._parts:
            return []
        words = b"".join(self._parts).decode("utf-8", "replace").strip()
        self._parts = []
        return [StatusText(self._severity, words)] if words else []
