"""Reads a flight log of a real ArduCopter by MAVLink FTP and by LOG_REQUEST_DATA: each is the file on its disk."""

from __future__ import annotations

import asyncio
import contextlib
import time
from pathlib import Path
from typing import Final

from bench.real_autopilot import RealAutopilot, Receiver, flying
from bench.rig import wait_for
from onboard_agent.autopilot.own_frames import FrameMaker, Sender
from onboard_agent.transactions.file_sending import NotSent, Sending, Sent
from onboard_agent.transactions.handler import Around
from onboard_agent.transactions.log_files import LogFiles
from onboard_agent.transactions.log_handler import LogHandler
from wire.dialect import mavlink
from wire.frame_stream import FrameStream
from wire.frames import message_id, source
from wire.transactions import LogDownloadWork, LogListWork, Outcome, Transaction, TransactionResult

TICK_S: Final = 0.025
LEAST_BYTES: Final = 3_000_000
RESTS: Final = 250
"""Looks at a file of one size, after which it is written no more."""
AROUND: Final = Around(
    system_id=1,
    autopilot_kind=mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA,
    vehicle_type=2,
    heard=True,
    armed=False,
    airborne=False,
    custom_mode=0,
    starting=False,
    flown_by_hand=False,
    holding=False,
    commanded=0,
    narrow_line=False,
)


class Tower:
    """A FileSender that keeps what it gets."""

    def __init__(self) -> None:
        self.state: Sending | Sent | NotSent = NotSent("nothing")
        self.got = b""

    def begin(self, transaction_id: int, path: Path) -> None:
        self.got, self.state = path.read_bytes(), Sent()

    def stop(self) -> None:
        pass


class Reader:
    """Steps the handler as the agent does: at each packet and forty times a second."""

    def __init__(self, autopilot: RealAutopilot, folder: Path, *, by_files: bool) -> None:
        self.tower = Tower()
        self.maker = FrameMaker()
        self.handler = LogHandler(self.maker, LogFiles(folder), self.tower)
        self._autopilot = autopilot
        self._by_files = by_files
        self._number = 0

    async def do(self, work: LogListWork | LogDownloadWork, deadline_s: float = 120.0) -> TransactionResult:
        loop = asyncio.get_running_loop()
        port, stream, handler = self._autopilot.port, FrameStream(), self.handler
        _, address = await loop.sock_recvfrom(port, 4096)
        self._number += 1
        handler.begin(Transaction(id=self._number, epoch=1, deadline_s=deadline_s, work=work), AROUND, loop.time())
        if self._by_files:
            capabilities = mavlink.MAVLink_autopilot_version_message(
                mavlink.MAV_PROTOCOL_CAPABILITY_FTP, *[0] * 4, *[[0] * 8] * 3, 0, 0, 0
            )
            handler.receive(self.maker.make(capabilities, Sender(1, 1)), loop.time())
        while True:
            for frame in handler.due(AROUND, loop.time()):
                await loop.sock_sendto(port, frame, address)
            for report in handler.reports():
                if isinstance(report, TransactionResult):
                    return report
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(TICK_S):
                    data, _ = await loop.sock_recvfrom(port, 4096)
                    for frame in stream.feed(data):
                        if source(frame) == (1, 1) and message_id(frame) in handler.hears:
                            handler.receive(frame, loop.time())


async def settled(log: Path, autopilot: RealAutopilot) -> bytes:
    """Lets it log on the ground until the file is large, ends that, and returns the file when it grows no more."""
    await wait_for("a long log", lambda: log.exists() and log.stat().st_size > LEAST_BYTES, 60.0)
    await autopilot.truth.set_parameter("LOG_DISARMED", 0)
    sizes: list[int] = [0]

    def rests() -> bool:
        sizes.append(log.stat().st_size)
        return len(sizes) > RESTS and sizes[-1] == sizes[-RESTS]

    await wait_for("the end of the log", rests, 60.0)
    return await asyncio.to_thread(log.read_bytes)


async def test_a_log_by_files_and_by_messages_is_the_file_on_its_disk(arducopter: Path, tmp_path: Path) -> None:
    ap = tmp_path / "ap"
    parameters = {"LOG_DISARMED": 1.0, "LOG_BITMASK": 0x3FFFF}
    async with flying(arducopter, ap, receiver=Receiver.NONE, parameters=parameters) as autopilot:
        on_disk = await settled(ap / "logs" / "00000001.BIN", autopilot)
        for by_files in (True, False):
            reader = Reader(autopilot, tmp_path / f"agent-{by_files}", by_files=by_files)
            listed = await reader.do(LogListWork())
            assert listed.logs is not None
            (log,) = [one for one in listed.logs if one.log_id == 1]
            assert log.size_bytes == len(on_disk)
            began = time.monotonic()
            result = await reader.do(LogDownloadWork(1))
            took_s = time.monotonic() - began
            assert result.outcome is Outcome.DONE, result.words
            assert ("checksum" in result.words) is by_files, result.words
            assert reader.tower.got == on_disk
            how = "MAVLink FTP" if by_files else "LOG_DATA"
            print(f"{how}: {len(on_disk)} bytes in {took_s:.2f} s, {len(on_disk) / took_s / 1000:.0f} kB/s")
