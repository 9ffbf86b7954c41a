"""The process that carries packets between the namespaces: from one TUN device to another, each when it is due.

Each host has an access link with a LinkModel for either direction; a packet traverses the sender's uplink and the
receiver's downlink. `bench.namespaces` starts it with the devices' file descriptors; profiles and queries for counts
arrive as JSON lines on standard input, and the process exits when that closes.
"""

from __future__ import annotations

import asyncio
import heapq
import json
import os
import sys
from dataclasses import dataclass

from bench.link_model import LinkModel, Profile

MTU = 1500
UP, DOWN = "up", "down"
SPIN_S = 0.0005


@dataclass
class Port:
    """One host's end."""

    descriptor: int
    up: LinkModel
    down: LinkModel


class Emulator:
    def __init__(self, ports: dict[bytes, Port]) -> None:
        """`ports` by the host's IPv4 address, four bytes."""
        self._ports = ports
        self._waiting: list[tuple[float, int, bytes, Port, bool]] = []
        """(due time, order, packet, receiver, whether it has traversed the receiver's link)."""
        self._count = 0
        self._loop = asyncio.get_running_loop()
        self._alarm: asyncio.TimerHandle | None = None
        for port in ports.values():
            self._loop.add_reader(port.descriptor, self._read, port)

    def _read(self, port: Port) -> None:
        now = self._loop.time()
        while True:
            try:
                packet = os.read(port.descriptor, MTU + 64)
            except BlockingIOError:
                break
            if len(packet) < 20 or packet[0] >> 4 != 4:
                continue  # neighbour discovery and the like
            receiver = self._ports.get(packet[16:20])
            if receiver is None:
                continue
            for due, copy in port.up.packet(packet, now):
                self._wait(due, copy, receiver, is_down=False)
        self._deliver()

    def _wait(self, due: float, packet: bytes, receiver: Port, *, is_down: bool) -> None:
        self._count += 1
        heapq.heappush(self._waiting, (due, self._count, packet, receiver, is_down))

    def _deliver(self) -> None:
        now = self._loop.time()
        while self._waiting and self._waiting[0][0] <= now + SPIN_S:
            due, _, packet, port, is_down = heapq.heappop(self._waiting)
            if not is_down:
                # Only now, because packets from others that arrive first traverse the downlink first.
                for later, copy in port.down.packet(packet, due):
                    self._wait(later, copy, port, is_down=True)
                continue
            try:
                os.write(port.descriptor, packet)
            except (BlockingIOError, OSError):
                port.down.lost += 1
        if self._alarm is not None:
            self._alarm.cancel()
            self._alarm = None
        if self._waiting:
            self._alarm = self._loop.call_at(self._waiting[0][0], self._deliver)


async def run(hosts: dict[str, tuple[bytes, int]], seed: int) -> None:
    """`hosts`: name to (address, descriptor)."""
    ports: dict[str, Port] = {}
    for number, (name, (_, descriptor)) in enumerate(hosts.items()):
        os.set_blocking(descriptor, False)
        up, down = (LinkModel(Profile(), seed * 100 + 2 * number + way) for way in (0, 1))
        ports[name] = Port(descriptor, up, down)
    Emulator({address: ports[name] for name, (address, _) in hosts.items()})
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    print("ready", flush=True)
    while line := await reader.readline():
        said = json.loads(line)
        port = ports[said["host"]]
        ways = {UP: port.up, DOWN: port.down}
        if said.get("count"):
            counts = {way: [model.passed, model.lost, model.passed_bytes] for way, model in ways.items()}
            print(json.dumps(counts), flush=True)
            continue
        for way, model in ways.items():
            if way in said:
                model.profile = Profile(**said[way])
        print("done", flush=True)


def main() -> None:
    """Arguments: the seed, then NAME=ADDRESS=DESCRIPTOR for each host."""
    hosts = {}
    for word in sys.argv[2:]:
        name, address, descriptor = word.split("=")
        hosts[name] = (bytes(int(part) for part in address.split(".")), int(descriptor))
    asyncio.run(run(hosts, int(sys.argv[1])))


if __name__ == "__main__":
    main()
