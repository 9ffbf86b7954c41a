"""The emulated network with real namespaces: its effect on packets, and its complete removal."""

import asyncio
import json
import statistics
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

from bench.link_model import Profile
from bench.namespaces import Network, emulated_network, why_not

pytestmark = pytest.mark.long("an emulated network that benchmarks alone use")

ECHO = """
import socket
s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
s.bind(("0.0.0.0", 9000))
print("listening", flush=True)
while True:
    data, peer = s.recvfrom(2048)
    s.sendto(data, peer)
"""
ASK = """
import json, socket, sys, time
s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
s.settimeout(1.0)
trips = []
for number in range(int(sys.argv[2])):
    begin = time.monotonic()
    s.sendto(b"%d" % number, (sys.argv[1], 9000))
    try:
        while s.recv(2048) != b"%d" % number:
            pass
        trips.append(time.monotonic() - begin)
    except TimeoutError:
        pass
print(json.dumps(trips))
"""


@pytest.fixture(autouse=True)
def _possible(missing: Callable[[str], None]) -> None:
    reason = why_not()
    if reason is not None:
        missing(reason)


async def listening(net: Network) -> None:
    echo = await net.run_in("tower", sys.executable, "-c", ECHO, stdout=asyncio.subprocess.PIPE)
    assert echo.stdout is not None
    assert await asyncio.wait_for(echo.stdout.readline(), 20) == b"listening\n"


async def round_trips(net: Network, count: int, host: str = "drone") -> list[float]:
    asking = await net.run_in(
        host, sys.executable, "-c", ASK, net.address("tower"), str(count), stdout=asyncio.subprocess.PIPE
    )
    said, _ = await asyncio.wait_for(asking.communicate(), 60)
    answer: list[float] = json.loads(said)
    return answer


async def test_round_trips_take_as_long_as_the_profile_says_and_a_change_counts_at_once() -> None:
    async with emulated_network({"drone": Profile(delay_s=0.05)}) as net:
        await listening(net)
        trips = await round_trips(net, 10)
        assert len(trips) == 10
        assert min(trips) >= 0.099
        assert statistics.median(trips) < 0.13
        await net.change("drone", Profile(black_out=True))
        assert await round_trips(net, 1) == []
        await net.change("drone", Profile())
        assert statistics.median(await round_trips(net, 10)) < 0.03


async def test_nobody_waits_for_packets_of_others_that_are_still_on_a_longer_way() -> None:
    async with emulated_network({"browser": Profile(delay_s=0.3)}) as net:
        await listening(net)
        far = asyncio.create_task(round_trips(net, 4, "browser"))
        near = await round_trips(net, 200)
        assert statistics.median(near) < 0.03
        assert max(near) < 0.25
        assert min(await far) >= 0.599


async def test_what_a_link_carried_and_lost_is_counted_each_way() -> None:
    async with emulated_network() as net:
        await listening(net)
        before = await net.carried("drone")
        await net.change("drone", up=Profile(loss=0.5), down=Profile())
        trips = await round_trips(net, 20)
        up, lost_up, down, lost_down, bytes_up, bytes_down = (
            late - early for late, early in zip(await net.carried("drone"), before, strict=True)
        )
        assert up + lost_up == 20 and lost_down == 0
        assert up == down == len(trips) < 20
        assert 29 * up <= bytes_up == bytes_down <= 30 * up


async def test_tcp_works_through_loss(tmp_path: Any) -> None:
    body = bytes(range(256)) * 400
    (tmp_path / "file").write_bytes(body)
    async with emulated_network({"drone": Profile(delay_s=0.005, loss=0.05)}) as net:
        server = (sys.executable, "-m", "http.server", "8000", "--directory", str(tmp_path))
        await net.run_in("tower", *server, stderr=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.DEVNULL)
        fetch = (
            "import sys, time, urllib.request\n"
            "for _ in range(200):\n"
            "    try:\n"
            f"        body = urllib.request.urlopen('http://{net.address('tower')}:8000/file', timeout=20).read()\n"
            "        break\n"
            "    except OSError:\n"
            "        time.sleep(0.05)\n"
            "sys.stdout.buffer.write(body)\n"
        )
        client = await net.run_in("drone", sys.executable, "-c", fetch, stdout=asyncio.subprocess.PIPE)
        fetched, _ = await asyncio.wait_for(client.communicate(), 60)
        assert fetched == body


def namespaces_left() -> str:
    return subprocess.run(["ip", "netns", "list"], capture_output=True, text=True, check=True).stdout


async def test_nothing_stays_behind_even_after_a_failure() -> None:
    names = []
    with pytest.raises(RuntimeError, match="on purpose"):
        async with emulated_network() as net:
            names = [net.namespace(host) for host in ("tower", "drone", "browser")]
            await listening(net)
            raise RuntimeError("on purpose")
    assert names and not any(name in namespaces_left() for name in names)
