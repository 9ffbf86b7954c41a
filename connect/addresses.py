"""`HOST:PORT` of local endpoints; other machines are admitted only on explicit request. Pure."""

from collections.abc import Callable

from connect.endpoints import Endpoint, TcpOn, UdpOn, UdpTo
from connect.tower_url import is_loopback
from connect.unusable import Unusable

DEFAULT_UDP = "127.0.0.1:14550"
"""The default port of QGroundControl, Mission Planner and MAVProxy."""


def endpoints_of(*, udp: list[str], udp_listen: list[str], tcp: list[str], other_machines: bool) -> list[Endpoint]:
    """Returns all requested endpoints; UDP to the usual port if none is requested. Raises Unusable."""
    made: list[Endpoint] = []
    if not (udp or udp_listen or tcp):
        udp = [DEFAULT_UDP]
    kinds: tuple[tuple[str, list[str], Callable[[str, int], Endpoint], int], ...] = (
        ("--udp", udp, UdpTo, 1),
        ("--udp-listen", udp_listen, UdpOn, 0),
        ("--tcp", tcp, TcpOn, 0),
    )
    for option, texts, make, least_port in kinds:
        for text in texts:
            host, port = _parse(option, text, least_port)
            if not is_loopback(host) and not other_machines:
                raise Unusable(
                    f"{option} {text} is not on this machine, and whoever reaches it would do what you may do: "
                    "say --other-machines if you want that"
                )
            made.append(make(host, port))
    return made


def _parse(option: str, text: str, least_port: int) -> tuple[str, int]:
    host, _, port_text = text.strip().rpartition(":")
    host = host.strip("[]")
    if not host or not (port_text.isascii() and port_text.isdigit()) or not least_port <= int(port_text) <= 65535:
        raise Unusable(f"{option} {text} must be HOST:PORT, like 127.0.0.1:14550")
    return host, int(port_text)
