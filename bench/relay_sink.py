"""The output at the other end: number, identity and latency of the frames. One for each measurement."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from bench.load_frames import Arrived


@dataclass
class Sink:
    """`take` is called with everything that arrives; `read` splits it into frames."""

    read: Callable[[bytes], Iterator[Arrived]]
    frames: int = 0
    messages: int = 0
    latencies_us: list[float] = field(default_factory=list)
    last_number: dict[int, int] = field(default_factory=dict)
    close_to: int | None = None
    """The drone that a viewer watches closely."""
    close_us: list[float] = field(default_factory=list)
    """Its latencies, which are among `latencies_us` too."""
    sticks_us: list[float] = field(default_factory=list)
    """Of sticks on their way down, from the browser's socket to the agent's."""
    out_of_order: int = 0
    """Transactional frames that were duplicated or out of order."""

    def take(self, message: bytes) -> None:
        now_us = time.monotonic() * 1e6
        self.messages += 1
        add = self.latencies_us.append
        for drone_id, _, sent_us, number in self.read(message):
            self.frames += 1
            add(now_us - sent_us)
            if drone_id == self.close_to:
                self.close_us.append(now_us - sent_us)
            if number:
                if number <= self.last_number.get(drone_id, 0):
                    self.out_of_order += 1
                self.last_number[drone_id] = number

    def clear(self) -> None:
        """Begins a new measurement. The numbering continues."""
        self.frames = self.messages = 0
        self.latencies_us, self.close_us, self.sticks_us = [], [], []
