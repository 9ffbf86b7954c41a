"""The camera of `tower-sim` as its viewers see it: over HTTP, from the real program."""

from __future__ import annotations

import http.client
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import av
import cv2
import numpy as np
import pytest
from worlds.clock_strip import age_ms, read_clock
from worlds.free_ports import free_tcp_port, free_udp_ports
from worlds.processes import wait_for

pytestmark = pytest.mark.long("the simulator's own pictures")

DEADLINE_S = 60.0


@dataclass
class Simulator:
    """One vehicle with a camera; `said` has its output."""

    process: subprocess.Popen[bytes]
    port: int
    said: Path

    def ask(self, method: str, path: str) -> tuple[int, str]:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=DEADLINE_S)
        try:
            connection.request(method, path)
            answer = connection.getresponse()
            return answer.status, answer.read().decode()
        finally:
            connection.close()

    def accepts(self) -> bool:
        try:
            socket.create_connection(("127.0.0.1", self.port), timeout=5).close()
        except ConnectionRefusedError:
            return False
        return True


class Viewer:
    """Reads the parts of `/camera`."""

    def __init__(self, port: int, query: str = "", receive_bytes: int | None = None) -> None:
        self.socket = socket.socket()
        if receive_bytes is not None:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_bytes)
        self.socket.settimeout(DEADLINE_S)
        self.socket.connect(("127.0.0.1", port))
        self.socket.sendall(f"GET /camera{query} HTTP/1.1\r\nHost: camera\r\n\r\n".encode())
        self._stream: IO[bytes] = self.socket.makefile("rb")
        self.status = self._stream.readline().decode().strip()
        self.headers = self._headers()
        assert self._stream.readline().startswith(b"--")

    def _headers(self) -> dict[str, str]:
        found = {}
        while (line := self._stream.readline()) not in (b"\r\n", b""):
            name, _, value = line.decode().partition(":")
            found[name.lower()] = value.strip()
        return found

    def part(self) -> tuple[int, bytes]:
        """Returns the capture time, in microseconds of Unix time, and the JPEG. Raises EOFError at the end."""
        headers = self._headers()
        if not headers:
            raise EOFError
        assert headers["content-type"] == "image/jpeg"
        jpeg = self._stream.read(int(headers["content-length"]))
        # The delimiter arrives with the picture, so that a reader knows it is complete without waiting for the next
        # one.
        assert self._stream.readline() == b"\r\n"
        assert self._stream.readline() == b"--picture\r\n"
        return int(headers["x-capture-unix-us"]), jpeg

    def close(self) -> None:
        self._stream.close()
        self.socket.close()


def luma(jpeg: bytes) -> np.ndarray:
    picture = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    return np.asarray(picture)


@pytest.fixture
def simulator(tmp_path: Path) -> Iterator[Simulator]:
    port, said = free_tcp_port(), tmp_path / "said"
    command = [str(Path(sys.executable).with_name("tower-sim")), "--home", "47.3977,8.5456,488,0"]
    command += ["--out", f"udp:127.0.0.1:{free_udp_ports(1)[0]}", "--camera", str(port)]
    with said.open("wb") as out:
        process = subprocess.Popen(command, stdout=out, stderr=subprocess.STDOUT)
    running = Simulator(process, port, said)
    wait_for("the camera", lambda: running.accepts() or process.poll() is not None)
    assert process.poll() is None, said.read_text()
    yield running
    process.send_signal(signal.SIGINT)
    try:
        assert process.wait(20) == 0, said.read_text()
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
    assert not running.accepts(), "the process of the cameras has been left behind"


def test_pictures_come_with_their_time_in_header_and_strip(simulator: Simulator) -> None:
    viewer = Viewer(simulator.port, "?width=320&height=240&rate=20")
    assert viewer.status == "HTTP/1.1 200 OK"
    assert viewer.headers["content-type"] == "multipart/x-mixed-replace; boundary=picture"
    times = []
    for _ in range(21):
        drawn_us, jpeg = viewer.part()
        picture = luma(jpeg)
        assert picture.shape == (240, 320)
        assert read_clock(picture) == drawn_us // 1000 % 65536
        assert abs(time.time_ns() // 1000 - drawn_us) < 5_000_000
        times.append(drawn_us)
    viewer.close()
    gaps = np.diff(times[1:])
    assert (gaps > 0).all()
    # On a busy machine any picture may be late, the one that is counted from too; one of ten is not.
    ahead_us = [(len(times) - 1 - first) * 50_000 - (times[-1] - times[first]) for first in range(1, 11)]
    assert min(ahead_us) < 25_000, "faster than asked for"


def test_pyav_reads_it_as_the_agent_will(simulator: Simulator) -> None:
    ages = []
    address = f"http://127.0.0.1:{simulator.port}/camera?width=640&height=480&rate=15"
    with av.open(address, timeout=DEADLINE_S, options={"fflags": "nobuffer"}) as container:
        for picture in container.decode(video=0):
            read = read_clock(picture.reformat(format="gray").to_ndarray())
            assert read is not None
            ages.append(age_ms(read, time.time_ns() // 1_000_000))
            if len(ages) == 45:
                break
    # A reader that had to wait for the next picture would never see one younger than 66 ms.
    assert min(ages[15:]) < 50


def test_who_does_not_read_gets_the_newest_picture_afterwards(simulator: Simulator) -> None:
    viewer = Viewer(simulator.port, "?width=640&height=480&rate=30&quality=95", receive_bytes=16_384)
    for _ in range(3):
        viewer.part()
    stopped_us = time.time_ns() // 1000
    time.sleep(1.5)  # the test: nothing has piled up after that long
    resumed_us = time.time_ns() // 1000
    drawn = []
    while not drawn or drawn[-1] < resumed_us:
        drawn.append(viewer.part()[0])
    viewer.close()
    old = [at for at in drawn if at < resumed_us - 100_000]
    assert len(old) <= 3, f"{len(old)} pictures have waited; 45 were due"
    assert all(at < stopped_us + 1_000_000 for at in old), "pictures were drawn while nobody read"


def test_it_is_unplugged_and_comes_back(simulator: Simulator) -> None:
    viewer = Viewer(simulator.port, "?width=320&height=240&rate=30")
    viewer.part()
    status, words = simulator.ask("POST", "/unplug?seconds=2")
    asked_s = time.monotonic()
    assert (status, words) == (202, "unplugged for 2 s\n")
    with pytest.raises((EOFError, OSError)):
        while True:
            viewer.part()
    viewer.close()
    wait_for("the port to refuse", lambda: not simulator.accepts())
    wait_for("the camera to be back", simulator.accepts)
    assert time.monotonic() - asked_s > 1.5
    again = Viewer(simulator.port, "?width=320&height=240&rate=30")
    again.part()
    again.close()
    said = simulator.said.read_text()
    assert "camera 1 is unplugged" in said
    assert "camera 1 is back" in said


def test_what_makes_no_sense_is_answered_with_a_clear_line(simulator: Simulator) -> None:
    assert simulator.ask("GET", "/camera?width=9") == (400, "width is a whole number from 64 to 1920\n")
    assert simulator.ask("GET", "/") == (404, "The camera is at /camera\n")
    assert simulator.ask("POST", "/camera")[0] == 404
    assert simulator.ask("POST", "/unplug?seconds=0")[0] == 400
    assert simulator.ask("DELETE", "/camera")[0] == 501


def test_a_port_that_is_taken_is_said(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        command = [str(Path(sys.executable).with_name("tower-sim")), "--home", "47,8"]
        command += ["--out", "udp:127.0.0.1:9", "--camera", str(taken.getsockname()[1])]
        done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S, check=False)
    assert done.returncode == 1
    assert "tower-sim: " in done.stderr
    assert "Traceback" not in done.stderr


def test_more_cameras_than_vehicles_are_refused() -> None:
    command = [str(Path(sys.executable).with_name("tower-sim")), "--home", "47,8", "--out", "udp:127.0.0.1:9"]
    command += ["--camera", "8090", "--camera", "8091"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S, check=False)
    assert done.returncode == 2
    assert "2 times --camera for 1 vehicles" in done.stderr.replace("│", "").replace("\n", " ")
