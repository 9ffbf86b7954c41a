"""The black box as the agent sees it: frames and time in, messages for the tower out. The disk is in a thread."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from onboard_agent.black_box.disk import BlackBoxDisk
from onboard_agent.black_box.tape import BlackBoxTape
from wire.black_box import BLACK_BOX, BlackBoxState, BlackBoxToTower, BlackBoxWanted

DEFAULT_MB: Final = 1000
"""A hundred hours of 50 frames a second. Little beside the 16 GB of a usual card."""


class BlackBox:
    """`folder` None, or a budget of 0: nothing is recorded."""

    def __init__(self, folder: Path | None, budget_mb: int, now: float) -> None:
        self._disk = BlackBoxDisk(folder, budget_mb * 1_000_000) if folder is not None and budget_mb else None
        self._tape = None if self._disk is None else BlackBoxTape(self._disk, _wall_us, now)
        self._taken = False
        self._told: tuple[object, ...] | None = None

    @property
    def takes(self) -> tuple[str, ...]:
        """For hello."""
        return () if self._disk is None else (BLACK_BOX,)

    def start(self) -> None:
        """Starts the thread."""
        if self._disk is not None:
            self._disk.start()

    def stop(self, now: float) -> None:
        """Ends the flight and waits a little for the disk."""
        if self._disk is not None and self._tape is not None:
            self._tape.stop(now)
            self._disk.stop()

    def add(self, frames: Sequence[bytes], now: float) -> None:
        """Frames of the autopilot or to it."""
        if self._tape is not None:
            self._tape.add(frames, now)

    def tick(self, now: float, *, armed: bool, heard: bool) -> None:
        """Many times a second."""
        if self._tape is not None:
            self._tape.tick(now, armed=armed, heard=heard)

    def link_up(self, takes: Sequence[str]) -> None:
        """A new link, or another control channel of the same one with the same `takes`."""
        self._taken = BLACK_BOX in takes
        self._told = None

    def link_resumed(self) -> None:
        """The link continues on another control channel: what was sent on the old one may be lost."""
        self._told = None

    def wanted(self, message: BlackBoxWanted) -> None:
        """The tower asks for a piece."""
        if self._disk is not None:
            self._disk.want(message)

    def messages(self, now: float, room: int) -> list[BlackBoxToTower]:
        """For the control channel. `room`: how many of those that can wait."""
        disk, tape = self._disk, self._tape
        if disk is None or tape is None or not self._taken or room < 2:
            return []
        messages: list[BlackBoxToTower] = []
        told = (disk.flights, disk.problem)
        if told != self._told:
            self._told = told
            messages.append(BlackBoxState(now_us=tape.now_us(now), flights=disk.flights, problem=disk.problem))
        answer = disk.answer
        if answer is not None:
            disk.answer = None
            messages.append(answer)
        return messages


def _wall_us() -> int:
    return time.time_ns() // 1000
