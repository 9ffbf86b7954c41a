"""The autopilot on a serial line, non-blocking both ways, opened again when the device returns."""

import asyncio
import errno
import logging
import os
from typing import Any, Final

from onboard_agent.autopilot_port.port import MAX_BACKLOG_BYTES, AutopilotPort, OnBytes
from onboard_agent.link.backoff import STEADY_S, Backoff

_log = logging.getLogger(__name__)

DEFAULT_BAUD: Final = 57_600
"""The default speed of MAVLink autopilots on a telemetry port."""


class SerialLine(AutopilotPort):
    """A device and a baud rate. Waits for a missing device: USB autopilots appear after the agent starts."""

    narrow = True

    def __init__(self, name: str, device: str, baud: int) -> None:
        super().__init__(name)
        self._device = device
        self._baud = baud
        self._line: Any = None
        self._fd = -1
        self._backlog = b""
        self._gone: asyncio.Future[str] | None = None

    @property
    def is_open(self) -> bool:
        """Whether the device is present and open."""
        return self._line is not None

    @property
    def backlog_bytes(self) -> int:
        """Bytes that wait for the line."""
        return len(self._backlog)

    async def run(self, received: OnBytes) -> None:
        import serial  # not in the memory of agents without a serial line

        loop = asyncio.get_running_loop()
        backoff = Backoff()
        is_logged = False
        while True:
            try:
                self._line = serial.Serial(self._device, self._baud, timeout=0, write_timeout=0, exclusive=True)
            except (OSError, ValueError) as error:
                if not is_logged:
                    _log.error("%s: cannot be opened (%s); waiting for it", self.name, _reason(error))
                    is_logged = True
                await asyncio.sleep(backoff.next_delay_s())
                continue
            is_logged = False
            opened_at = loop.time()
            self._fd = self._line.fileno()
            self._backlog = b""
            self._gone = loop.create_future()
            self.on_open()
            _log.info("%s: open at %d baud", self.name, self._baud)
            loop.add_reader(self._fd, self._readable, received)
            try:
                why = await self._gone
                _log.warning("%s: gone (%s); waiting for it to come back", self.name, why)
                is_logged = True
            finally:
                self._close(loop)
            if loop.time() - opened_at >= STEADY_S:
                backoff.reset()
            await asyncio.sleep(backoff.next_delay_s())

    def send(self, data: bytes) -> None:
        if self._line is None:
            self.counts["autopilot not there"] += 1
        elif len(self._backlog) + len(data) > MAX_BACKLOG_BYTES:
            self.counts["autopilot too slow"] += 1
        elif self._backlog:
            self._backlog += data
        else:
            self._backlog = data
            self._writable()
            if self._backlog:
                asyncio.get_running_loop().add_writer(self._fd, self._drain)

    def _readable(self, received: OnBytes) -> None:
        try:
            data = os.read(self._fd, 4096)
        except (BlockingIOError, InterruptedError):
            return
        except OSError as error:
            self._lost(_reason(error))
            return
        if data:
            received(data)
        else:
            self._lost("end of file")

    def _writable(self) -> None:
        try:
            written = os.write(self._fd, self._backlog)
        except (BlockingIOError, InterruptedError):
            return
        except OSError as error:
            self._lost(_reason(error))
            return
        self._backlog = self._backlog[written:]

    def _drain(self) -> None:
        self._writable()
        if not self._backlog:
            asyncio.get_running_loop().remove_writer(self._fd)

    def _lost(self, why: str) -> None:
        if self._gone is not None and not self._gone.done():
            asyncio.get_running_loop().remove_reader(self._fd)
            self._gone.set_result(why)

    def _close(self, loop: asyncio.AbstractEventLoop) -> None:
        loop.remove_reader(self._fd)
        loop.remove_writer(self._fd)
        self._line.close()
        self._line = None
        self._fd = -1
        self._backlog = b""


def _reason(error: Exception) -> str:
    """Returns one short reason; pyserial wraps the system's in a long sentence."""
    number = getattr(error, "errno", None)
    if number == errno.EACCES:
        return "permission denied: is the agent's user in the group dialout?"
    return os.strerror(number) if isinstance(number, int) else str(error)
