"""The autopilot's port with signatures. Thin shell around SignedLine."""

import asyncio
import time
from pathlib import Path

from onboard_agent.autopilot_port.port import AutopilotPort, OnBytes
from onboard_agent.signing.key_file import KeyFile
from onboard_agent.signing.signed_line import SignedLine
from onboard_agent.system_file import SystemFile
from wire.drops import DropReason
from wire.frame_stream import FrameStream


class SignedPort(AutopilotPort):
    """`inner` leads to the autopilot."""

    def __init__(self, inner: AutopilotPort, line: SignedLine) -> None:
        super().__init__(inner.name)
        self.speaks_first, self.narrow, self.counts = inner.speaks_first, inner.narrow, inner.counts
        self.line = line
        self._inner = inner
        self._stream = FrameStream()

    async def run(self, received: OnBytes) -> None:
        loop = asyncio.get_running_loop()
        self._inner.on_open = self._opened

        def heard(data: bytes) -> None:
            if self.line.is_plain:
                received(data)
                return
            frames = self._stream.feed(data)
            taken = self.line.open(frames, loop.time())
            if taken:
                received(b"".join(taken))
            if len(taken) < len(frames):
                self.counts[DropReason.SIGNATURE] += len(frames) - len(taken)

        await self._inner.run(heard)

    def send(self, data: bytes) -> None:
        self._inner.send(self.line.sign(data, time.time()))

    def _opened(self) -> None:
        self._stream = FrameStream()
        self.on_open()


def with_signing(port: AutopilotPort, state: Path, system_id: int | None) -> tuple[SignedPort, KeyFile]:
    """Returns the port with the keys of a drone's state folder, and where they are kept. `system_id`: as it is set."""
    file = KeyFile(state)
    return SignedPort(port, SignedLine(file.read(), system_id or SystemFile(state).read())), file
