"""A relay between an agent and its simulator that notes when MAVLink commands and sticks pass to the simulator.

Runs in its own thread, for synchronous tests. Both sides speak UDP on the loopback.
"""

import select
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise

from wire.dialect import decode
from wire.frame_stream import FrameStream


class FrameTap:
    def __init__(self, agent_port: int) -> None:
        self._agent = ("127.0.0.1", agent_port)
        self._to_simulator = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._to_simulator.bind(("127.0.0.1", 0))
        self._to_agent = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._to_agent.bind(("127.0.0.1", 0))
        self.port: int = self._to_simulator.getsockname()[1]
        """The port for the simulator to send to."""
        self.commands: list[tuple[float, int]] = []
        """When each COMMAND_LONG left for the simulator (`time.monotonic`), and which."""
        self.sticks: list[float] = []
        """When each message with sticks left for the simulator."""
        self.setpoints: list[float] = []
        """When each set-point (SET_POSITION_TARGET_*) left for the simulator."""
        self._over = threading.Event()

    def first_after(self, at_s: float, command: int) -> float | None:
        """Returns the seconds from `at_s` to the first such command after it."""
        return next((came - at_s for came, which in self.commands if came >= at_s and which == command), None)

    def longest_gap_s(self, since_s: float) -> float:
        """Returns the longest time without sticks since then, the present one included."""
        times = [since_s, *(at for at in self.sticks if at >= since_s), time.monotonic()]
        return max(later - earlier for earlier, later in pairwise(times))

    def run(self) -> None:
        simulator = None
        while not self._over.is_set():
            ready, _, _ = select.select([self._to_simulator, self._to_agent], [], [], 0.1)
            for side in ready:
                datagram, sender = side.recvfrom(65_535)
                if side is self._to_simulator:
                    simulator = sender
                    self._to_agent.sendto(datagram, self._agent)
                elif simulator is not None:
                    self._note(datagram)
                    self._to_simulator.sendto(datagram, simulator)

    def _note(self, datagram: bytes) -> None:
        at_s = time.monotonic()
        for frame in FrameStream().feed(datagram):
            message = decode(bytes(frame))
            if message is not None and message.get_type() == "COMMAND_LONG":
                self.commands.append((at_s, message.command))
            elif message is not None and message.get_type() in ("MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE"):
                self.sticks.append(at_s)
            elif message is not None and message.get_type().startswith("SET_POSITION_TARGET_"):
                self.setpoints.append(at_s)

    def stop(self) -> None:
        self._over.set()

    def close(self) -> None:
        self._to_simulator.close()
        self._to_agent.close()


@contextmanager
def frame_tap(agent_port: int) -> Iterator[FrameTap]:
    tap = FrameTap(agent_port)
    thread = threading.Thread(target=tap.run, daemon=True)
    thread.start()
    try:
        yield tap
    finally:
        tap.stop()
        thread.join(5)
        tap.close()
