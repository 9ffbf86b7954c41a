"""A drone with two ways out, each through a carrier of its own that can be cut. Real packets of a real kernel.

    drone   wlan0  --  carrier 0  --  tower
            wwan0  --  carrier 1  --

A carrier that is cut says nothing to anybody: both ends find out by silence, as with a cell that is left.
"""

import contextlib
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from bench.namespaces import inside_namespace

UPLINKS: Final = ("wlan0", "wwan0")
TOWER: Final = "10.80.0.1"


class TwoUplinks:
    """`address(uplink)` is the drone's address there."""

    def __init__(self) -> None:
        self._label = f"two{os.getpid()}"

    def namespace(self, host: str) -> str:
        return f"{self._label}-{host}"

    def address(self, uplink: str) -> str:
        return f"10.78.{UPLINKS.index(uplink)}.2"

    @contextlib.contextmanager
    def inside(self, host: str) -> Iterator[None]:
        with inside_namespace(f"/run/netns/{self.namespace(host)}"):
            yield

    def cut(self, uplink: str) -> None:
        self._forward(UPLINKS.index(uplink), on=False)

    def mend(self, uplink: str) -> None:
        self._forward(UPLINKS.index(uplink), on=True)

    def _forward(self, carrier: int, *, on: bool) -> None:
        with self.inside(f"carrier{carrier}"):
            Path("/proc/sys/net/ipv4/ip_forward").write_text("1" if on else "0")

    def start(self) -> None:
        for host in ("drone", "tower", "carrier0", "carrier1"):
            _ip("netns", "add", self.namespace(host))
            self._in(host, "link", "set", "lo", "up")
        self._in("tower", "addr", "add", f"{TOWER}/32", "dev", "lo")
        for number, uplink in enumerate(UPLINKS):
            carrier = f"carrier{number}"
            self._cable("drone", uplink, f"10.78.{number}.2/24", carrier, "fromdrone", f"10.78.{number}.1/24")
            self._cable("tower", f"to{number}", f"10.79.{number}.2/24", carrier, "fromtower", f"10.79.{number}.1/24")
            self._in(carrier, "route", "add", TOWER, "via", f"10.79.{number}.2")
            self._in("tower", "route", "add", f"10.78.{number}.0/24", "via", f"10.79.{number}.1")
            way = (TOWER, "via", f"10.78.{number}.1", "dev", uplink, "metric", f"{100 + number}")
            self._in("drone", "route", "add", *way)
            self.mend(uplink)

    def _cable(self, host: str, device: str, address: str, carrier: str, port: str, port_address: str) -> None:
        """Connects a host and a carrier, with an address at each end."""
        inner = ("link", "add", device, "type", "veth", "peer", "name", port, "netns", self.namespace(carrier))
        self._in(host, *inner)
        for where, end, its in ((host, device, address), (carrier, port, port_address)):
            self._in(where, "addr", "add", its, "dev", end)
            self._in(where, "link", "set", end, "up")

    def _in(self, host: str, *words: str) -> None:
        _ip("-n", self.namespace(host), *words)

    def stop(self) -> None:
        """Runs each step even if another fails."""
        for host in ("drone", "tower", "carrier0", "carrier1"):
            with contextlib.suppress(subprocess.CalledProcessError):
                _ip("netns", "del", self.namespace(host))


@contextlib.contextmanager
def two_uplinks() -> Iterator[TwoUplinks]:
    network = TwoUplinks()
    try:
        network.start()
        yield network
    finally:
        network.stop()


def _ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True)
