"""A text as STATUSTEXT messages: a long one in numbered pieces."""

from __future__ import annotations

from simulator.dialect import Message, mavlink
from simulator.notices import Notice

TEXT_MAX = 50


class StatusTexts:
    def __init__(self) -> None:
        self._id = 0

    def of(self, notice: Notice) -> list[Message]:
        text = notice.text.encode("ascii", "replace")
        pieces = [text[i : i + TEXT_MAX] for i in range(0, len(text), TEXT_MAX)]
        number = 0
        if len(pieces) > 1:
            self._id = self._id % 65535 + 1
            number = self._id
        severity = int(notice.severity)
        return [mavlink.MAVLink_statustext_message(severity, piece, number, at) for at, piece in enumerate(pieces)]
