"""Video between towers: a second connection to NATS, so that no picture stands before a stick on the way.

A TCP connection delivers in order. On the connection of the sticks a key picture would delay them, and a lost packet of
video would hold them up.
"""

from __future__ import annotations

import asyncio
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from server.live.hub import Hub
from server.towers.api.nats_bus import NatsBus
from server.towers.core.messages import MalformedPacket
from server.towers.core.towers import Towers
from server.towers.core.video_exports import VideoExports
from server.towers.core.video_imports import VideoImports
from server.towers.core.video_messages import (
    UnitSent,
    VideoMessage,
    VideoTold,
    decode_video,
    encode_video,
    read_video_header,
)
from wire.lateness import Lateness

PREFIX: Final = "control-tower.video"
CONFIRMED_WITHIN_S: Final = 0.02
"""Units that arrive within this time are confirmed together. A viewer may take three times as long (pacing.py)."""
FIRST_VERSION: Final = 3
"""Of the bus: towers before it send no video."""


class VideoBus:
    """One for a tower."""

    def __init__(
        self,
        url: str,
        me: str,
        hub: Hub,
        towers: Towers,
        *,
        may_act: Callable[[], bool],
        keys: Callable[[], Sequence[bytes]],
        authority: Path | None,
    ) -> None:
        self._me = me
        self._towers = towers
        self._may_act = may_act
        self._lateness: defaultdict[str, Lateness] = defaultdict(Lateness)
        self._confirming: asyncio.TimerHandle | None = None
        self.bus = NatsBus(
            url, me, on_packet=self._received, keys=keys, prefix=PREFIX, gives_way=True, authority=authority
        )
        self.exports = VideoExports(hub, self, is_heard=self._is_heard)
        self.imports = VideoImports(
            hub,
            self,
            home_of=towers.home_of,
            sends_video=lambda tower: towers.understands(tower, FIRST_VERSION),
            wake=self._confirm_soon,
        )

    async def open(self) -> None:
        """Raises BusUnavailable."""
        await self.bus.open()

    async def close(self) -> None:
        """Idempotent."""
        if self._confirming is not None:
            self._confirming.cancel()
        await self.bus.close()

    def send(self, tower: str, message: VideoMessage) -> None:
        """See Bus."""
        self.bus.publish(tower, encode_video(self._me, message, time.monotonic()))

    def has_room(self) -> bool:
        """See Bus."""
        return self.bus.is_connected and self.bus.has_room()

    def tick(self, now: float) -> None:
        """Ten times a second."""
        for tower in [tower for tower in self._lateness if tower not in self._towers.others]:
            del self._lateness[tower]
            self.bus.forget(tower)
        self.exports.tick(now)  # first: a drone that has left is not to be asked for in the name of other towers
        self.imports.tick(now)

    def _is_heard(self, tower: str) -> bool:
        other = self._towers.others.get(tower)
        return other is not None and other.is_ready

    def _received(self, packet: bytes) -> None:
        if not self._may_act():
            return
        now = time.monotonic()
        try:
            header = read_video_header(packet)
            if not self._is_heard(header.sender):
                self.imports.dropped["unknown tower"] += 1
                return
            message = decode_video(header.body)
        except MalformedPacket:
            self.imports.dropped["malformed"] += 1
            return
        late_s = self._lateness[header.sender].late_by(header.sent_ms, now)
        if isinstance(message, UnitSent | VideoTold):
            self.imports.heard(header.sender, message, late_s, now)
        else:
            self.exports.heard(header.sender, message, now)

    def _confirm_soon(self) -> None:
        self._confirming = asyncio.get_running_loop().call_later(CONFIRMED_WITHIN_S, self._confirm)

    def _confirm(self) -> None:
        self.imports.confirm(time.monotonic())
