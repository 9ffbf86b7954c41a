"""The resources that a process has used so far: processor time to the nanosecond, memory. From /proc, of all
threads."""

from __future__ import annotations

import os
from pathlib import Path

_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")


def cpu_us(pid: int) -> float:
    """Returns the microseconds of processor time of the process with all its live threads. Raises OSError if it is
    gone."""
    total_ns = 0
    for task in Path(f"/proc/{pid}/task").iterdir():
        try:
            total_ns += int((task / "schedstat").read_text().split()[0])
        except FileNotFoundError:  # a thread that ended just now
            continue
    return total_ns / 1000.0


def udp_drops(port: int) -> int:
    """Returns how many datagrams the socket on this port has dropped for lack of room, since it was opened."""
    here = f":{port:04X} "
    table = Path("/proc/net/udp").read_text().splitlines()
    return sum(int(line.split()[-1]) for line in table if here in line[:24])


def rss_mb(pid: int) -> float:
    """Returns the resident memory in MB (10**6 bytes)."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * _PAGE_BYTES / 1e6
