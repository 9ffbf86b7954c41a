"""Live video seen from outside: processes, connections to a camera, the tower's own metrics."""

import contextlib
import socket
import threading
import time
import urllib.request
from concurrent.futures import Future
from pathlib import Path
from typing import Final

from worlds.processes import Visitor

_ESTABLISHED: Final = "01"


def video_process_of(agent_pid: int) -> int | None:
    """Returns the video process of an agent, or None."""
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            with contextlib.suppress(OSError):
                parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
                if parent == agent_pid and b"onboard_agent.video" in (folder / "cmdline").read_bytes():
                    return int(folder.name)
    return None


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def looking_through(camera_port: int) -> int:
    """Returns the number of connections to a camera."""
    rows = [row.split() for row in Path("/proc/net/tcp").read_text().splitlines()[1:]]
    return sum(row[3] == _ESTABLISHED and int(row[1].rpartition(":")[2], 16) == camera_port for row in rows)


def units_from_agents(admin: Visitor) -> float:
    """Returns the tower's count of video units from agents."""
    name = 'tower_video_units_total{direction="in",peer="agent"}'
    request = urllib.request.Request(f"{admin.address}/metrics", headers={"Cookie": admin.cookie})
    with urllib.request.urlopen(request, timeout=10) as answer:
        lines = answer.read().decode().splitlines()
    return sum(float(line.rpartition(" ")[2]) for line in lines if line.startswith(name))


def unplugged_at(camera_port: int) -> Future[float]:
    """Returns the monotonic time at which the camera ends our own connection. The camera must be plugged in now."""
    found: Future[float] = Future()
    camera = socket.create_connection(("127.0.0.1", camera_port), timeout=30)
    camera.sendall(b"GET /camera?width=64&height=48&rate=2 HTTP/1.1\r\nHost: camera\r\n\r\n")
    assert b"200" in camera.recv(4096)

    def look() -> None:
        with camera:
            try:
                with contextlib.suppress(ConnectionError):
                    while camera.recv(65536):
                        pass
                found.set_result(time.monotonic())
            except OSError as error:  # the camera was never unplugged
                found.set_exception(error)

    threading.Thread(target=look, daemon=True).start()
    return found
