"""The table of transports to an autopilot. The parser and the help text both use it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from onboard_agent.autopilot_port.port import AutopilotPort
from onboard_agent.autopilot_port.serial_line import DEFAULT_BAUD, SerialLine
from onboard_agent.autopilot_port.tcp import TcpIn, TcpOut
from onboard_agent.autopilot_port.udp import UdpIn, UdpOut
from onboard_agent.unusable import Unusable


@dataclass(frozen=True)
class Scheme:
    """One transport: its notation, its meaning, and its factory, called with (whole text, part after the scheme)."""

    form: str
    meaning: str
    make: Callable[[str, str], AutopilotPort]


def _host_and_port(name: str, rest: str) -> tuple[str, int]:
    host, _, port_text = rest.rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    if not host or not port_text.isdecimal() or int(port_text) > 65535:
        raise Unusable(f"{name}: expected HOST:PORT after the scheme")
    return host, int(port_text)


def _network(kind: Callable[[str, str, int], AutopilotPort]) -> Callable[[str, str], AutopilotPort]:
    return lambda name, rest: kind(name, *_host_and_port(name, rest))


def _serial(name: str, rest: str) -> AutopilotPort:
    device, colon, baud_text = rest.rpartition(":")
    if not colon:
        device, baud_text = rest, str(DEFAULT_BAUD)
    if not device or not baud_text.isdecimal() or int(baud_text) == 0:
        raise Unusable(f"{name}: expected DEVICE or DEVICE:BAUD after the scheme")
    return SerialLine(name, device, int(baud_text))


MSP_BAUD: Final = 115_200
"""The default speed of MSP."""


def _msp(name: str, rest: str) -> AutopilotPort:
    from onboard_agent.autopilot_port.msp import MspPort  # not in the memory of every other agent

    scheme, _, where = rest.partition(":")
    if scheme == "tcp":
        return MspPort(name, TcpOut(name, *_host_and_port(name, where)))
    if not rest.startswith("/"):
        raise Unusable(f"{name}: expected /DEVICE, /DEVICE:BAUD or tcp:HOST:PORT after the scheme")
    return MspPort(name, _serial(name, rest if ":" in rest else f"{rest}:{MSP_BAUD}"))


SCHEMES: Final[dict[str, Scheme]] = {
    "udpin": Scheme("udpin:HOST:PORT", "wait for the autopilot on this UDP port", _network(UdpIn)),
    "udpout": Scheme("udpout:HOST:PORT", "speak to an autopilot that listens on UDP", _network(UdpOut)),
    "tcp": Scheme("tcp:HOST:PORT", "connect to an autopilot that listens on TCP", _network(TcpOut)),
    "tcpin": Scheme("tcpin:HOST:PORT", "wait for the autopilot to connect over TCP", _network(TcpIn)),
    "msp": Scheme(
        "msp:DEVICE[:BAUD] or msp:tcp:HOST:PORT",
        f"a controller that speaks MSP, such as Betaflight or INAV ({MSP_BAUD} baud unless told)",
        _msp,
    ),
    "serial": Scheme("serial:DEVICE[:BAUD]", f"a serial line ({DEFAULT_BAUD} baud unless told)", _serial),
}

FORMS: Final = " | ".join(scheme.form for scheme in SCHEMES.values())


def help_text() -> str:
    """Returns one phrase for each transport."""
    return "; ".join(f"{scheme.form}: {scheme.meaning}" for scheme in SCHEMES.values())


def make_port(text: str) -> AutopilotPort:
    """Returns the port that `text` names, not opened yet. Raises Unusable."""
    name = text.strip()
    scheme, _, rest = name.partition(":")
    found = SCHEMES.get(scheme)
    if found is None:
        raise Unusable(f"the autopilot {name!r} is of no known kind; known: {FORMS}")
    return found.make(name, rest)
