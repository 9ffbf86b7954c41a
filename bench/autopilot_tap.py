"""A tap between an agent and a real autopilot. It hides nothing from either, because motion is read elsewhere."""

from __future__ import annotations

import contextlib
import socket

from bench.real_autopilot import RealAutopilot
from bench.real_px4 import RealPx4
from bench.tap import Tap
from wire.frames import MalformedFrame, split_frames


class AutopilotTap(Tap):
    """`motions` and `tilts` are the true values, from `autopilot.truth`."""

    def __init__(
        self, agent: tuple[str, int], autopilot: RealAutopilot | RealPx4, *, bound_to: str = "127.0.0.1"
    ) -> None:
        """`bound_to`: an address of the host that can reach the agent."""
        super().__init__(agent)
        self._bound_to = bound_to
        self.motions = autopilot.truth.motions
        self.tilts = autopilot.truth.tilts
        self.timed_texts = autopilot.truth.texts
        self._inner = autopilot.port

    def open(self) -> None:
        """The socket towards the agent belongs to the host in which this is called."""
        assert self._inner is not None
        self._outer = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._outer.setblocking(False)
        self._outer.bind((self._bound_to, 0))
        self._loop.add_reader(self._inner, self._from_simulator)
        self._loop.add_reader(self._outer, self._from_agent)

    def inject(self, frame: bytes) -> None:
        """Sends a frame to the agent, as if another machine were on the autopilot's line."""
        assert self._outer is not None
        self._outer.sendto(frame, self._agent)

    def _from_simulator(self) -> None:
        assert self._inner is not None and self._outer is not None
        while True:
            try:
                data, self._simulator = self._inner.recvfrom(4096)
            except (BlockingIOError, ConnectionError):
                return
            now = self._loop.time()
            with contextlib.suppress(ConnectionError):  # a dead agent's port
                self._outer.sendto(data, self._agent)
            with contextlib.suppress(MalformedFrame):
                for frame in split_frames(data):
                    self._keep(frame, now)

    def _from_agent(self) -> None:
        with contextlib.suppress(ConnectionError):
            super()._from_agent()
