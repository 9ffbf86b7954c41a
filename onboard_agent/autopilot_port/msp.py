"""A flight controller that speaks MSP, on a serial line or over TCP. Thin shell around `MspTranslator`."""

import asyncio

from onboard_agent.autopilot.msp.translator import TICK_S, MspTranslator
from onboard_agent.autopilot_port.port import AutopilotPort, OnBytes


class MspPort(AutopilotPort):
    """`line` carries the bytes of MSP. It looks like an autopilot that speaks MAVLink."""

    def __init__(self, name: str, line: AutopilotPort) -> None:
        super().__init__(name)
        self._line = line
        self._translator = MspTranslator()
        self.counts = line.counts
        self._received: OnBytes | None = None

    async def run(self, received: OnBytes) -> None:
        loop = asyncio.get_running_loop()
        self._received = received
        self._line.on_open = self._opened

        def from_line(data: bytes) -> None:
            self._pass_on(self._translator.from_controller(data, loop.time()))

        async def tick() -> None:
            while True:
                self._pass_on(self._translator.tick(loop.time()))
                await asyncio.sleep(TICK_S)

        ticking = asyncio.create_task(tick())
        try:
            await self._line.run(from_line)
        finally:
            ticking.cancel()
            await asyncio.wait({ticking})

    def send(self, data: bytes) -> None:
        self._pass_on(self._translator.from_agent(data, asyncio.get_running_loop().time()))

    def _opened(self) -> None:
        self._translator = MspTranslator()  # perhaps another controller, or a restarted one
        self.on_open()

    def _pass_on(self, out: tuple[bytes, bytes]) -> None:
        to_controller, to_agent = out
        if to_controller:
            self._line.send(to_controller)
        if to_agent and self._received is not None:
            self._received(to_agent)
