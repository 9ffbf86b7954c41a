"""One line to several autopilots, for one agent each: every agent gets all bytes, and takes those of its own system."""

import asyncio

from onboard_agent.autopilot_port.port import AutopilotPort, OnBytes


def share(port: AutopilotPort, count: int) -> list[AutopilotPort]:
    """Returns a port for each of `count` agents. Run all of them: the first runs the line."""
    line = _Line(port)
    return [_Part(line, is_first=number == 0) for number in range(count)]


class _Line:
    def __init__(self, port: AutopilotPort) -> None:
        self.port = port
        self.parts: list[_Part] = []
        port.on_open = self._opened

    def _opened(self) -> None:
        for part in self.parts:
            part.on_open()

    def received(self, data: bytes) -> None:
        for part in self.parts:
            if part.received is not None:
                part.received(data)


class _Part(AutopilotPort):
    def __init__(self, line: _Line, *, is_first: bool) -> None:
        super().__init__(line.port.name)
        self._line = line
        self._is_first = is_first
        self.speaks_first, self.narrow = line.port.speaks_first, line.port.narrow
        self.received: OnBytes | None = None
        if is_first:
            self.counts = line.port.counts
        line.parts.append(self)

    async def run(self, received: OnBytes) -> None:
        self.received = received
        if self._is_first:
            await self._line.port.run(self._line.received)
        else:
            await asyncio.get_running_loop().create_future()

    def send(self, data: bytes) -> None:
        self._line.port.send(data)
