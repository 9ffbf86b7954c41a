"""One line that several autopilots share, as behind a router: all that they send comes to the agent from one address,
and all that the agent sends goes to each of them."""

import contextlib
import socket
import threading
from collections.abc import Iterator


@contextlib.contextmanager
def shared_line(agent_port: int) -> Iterator[int]:
    """Yields the UDP port that the autopilots send to."""
    line, agent = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
    autopilots: set[tuple[str, int]] = set()
    ends = threading.Event()
    for one in (line, agent):
        one.bind(("127.0.0.1", 0))
        one.settimeout(0.1)

    def up() -> None:
        while not ends.is_set():
            with contextlib.suppress(OSError):  # nothing came, or nobody listens yet
                data, sender = line.recvfrom(65_535)
                autopilots.add(sender)
                agent.sendto(data, ("127.0.0.1", agent_port))

    def down() -> None:
        while not ends.is_set():
            with contextlib.suppress(OSError):
                data = agent.recv(65_535)
                for one in tuple(autopilots):
                    line.sendto(data, one)

    threads = [threading.Thread(target=one) for one in (up, down)]
    for thread in threads:
        thread.start()
    try:
        yield line.getsockname()[1]
    finally:
        ends.set()
        for thread in threads:
            thread.join()
        line.close()
        agent.close()
