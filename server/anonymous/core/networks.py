"""What counts as one peer, and as one neighbourhood of peers. Pure."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from functools import lru_cache


@dataclass(frozen=True, slots=True)
class Origin:
    """The origin of a client. Text that is not an IP address stands for itself."""

    address: str
    """The IPv4 address, or the /64 of an IPv6 address, because its owner has all of it."""
    network: str
    """The /24 or /48 around it."""


@lru_cache(maxsize=4096)
def origin_of(address: str) -> Origin:
    """An IPv4 address that is written as IPv6 counts as what it is; a zone (`fe80::1%eth0`) counts for nothing."""
    try:
        ip = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return Origin(address, address)
    if isinstance(ip, ipaddress.IPv6Address) and ip.ipv4_mapped is not None:
        ip = ip.ipv4_mapped
    if isinstance(ip, ipaddress.IPv4Address):
        return Origin(str(ip), _around(ip, 24))
    return Origin(_around(ip, 64), _around(ip, 48))


def _around(ip: ipaddress.IPv4Address | ipaddress.IPv6Address, bits: int) -> str:
    return str(ipaddress.ip_network(f"{ip}/{bits}", strict=False))
