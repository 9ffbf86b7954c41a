"""Assembles the autopilot's STATUSTEXTs and keeps them for a while, as reasons for refusals. No I/O; takes `now`.

COMMAND_ACK carries no reason. ArduPilot sends it in one or several texts, some tens of milliseconds before or after the
acknowledgement.
"""

from collections import deque
from typing import Any, Final

from wire.dialect import mavlink

MAX_TEXTS: Final = 12
"""An autopilot that refuses to arm gives up to six reasons."""

MILDEST_REASON: Final = mavlink.MAV_SEVERITY_WARNING
"""Texts of this severity or worse may be a reason for a refusal."""

_CHUNK_CHARS: Final = 50
"""Length of the text field of STATUSTEXT. A shorter chunk is the last one."""


class StatusTexts:
    """Feed it each STATUSTEXT of the autopilot; read the texts with `since`."""

    def __init__(self) -> None:
        self._texts: deque[tuple[float, str]] = deque(maxlen=MAX_TEXTS)
        self._open_id = 0
        self._chunks: list[str] = []

    def receive(self, message: Any, now: float) -> None:
        """Takes a STATUSTEXT."""
        if message.severity > MILDEST_REASON:
            return
        if message.id == 0:
            self._keep(message.text, now)
            return
        if message.id != self._open_id or message.chunk_seq == 0:
            self._open_id, self._chunks = message.id, []
        if message.chunk_seq == len(self._chunks):
            self._chunks.append(message.text)
            if len(message.text) < _CHUNK_CHARS:
                self._keep("".join(self._chunks), now)
                self._open_id = 0

    def _keep(self, text: str, now: float) -> None:
        self._texts.append((now, text.strip()))

    def since(self, moment: float) -> list[str]:
        """Returns each text since `moment` once, oldest first."""
        return list(dict.fromkeys(text for at, text in self._texts if at >= moment and text))
