"""Connections to servers that somebody named: for tiles of maps, and for webhooks.

A name is resolved once, every address it has is judged, and the connection goes to the one that was judged, so that a
name that answers differently a moment later leads nowhere else. Whoever uses it follows no redirects. Blocks.
"""

from __future__ import annotations

import http.client
import ipaddress
import socket
import ssl
from contextlib import suppress
from typing import Final

CONNECT_WITHIN_S: Final = 5.0
_CARRIES_IPV4: Final = ipaddress.IPv6Network("64:ff9b::/96")
"""NAT64 (RFC 6052): the network may lead such an address to the IPv4 one in it."""
_GLOBAL_IPV6: Final = ipaddress.IPv6Network("2000::/3")
"""All that is assigned as global unicast. What else there is leads somewhere inside: NAT64 of a local network (RFC
8215), addresses that contain an IPv4 one, site-local ones."""
_PRIVATE_IPV6: Final = (ipaddress.IPv6Network("fc00::/7"), ipaddress.IPv6Network("::1/128"))
_METADATA: Final = frozenset(
    map(
        ipaddress.ip_address,
        ("fd00:ec2::254", "fd20:ce::254", "100.100.100.200", "168.63.129.16", "192.0.0.192"),
    )
)
"""Where clouds tell a machine its secrets, besides link-local addresses."""


class AddressUnknown(Exception):
    """The name of the server is not known."""


class AddressRefused(Exception):
    """One of its addresses is not allowed."""


def judged_address(host: str, port: int, *, may_be_private: bool) -> str:
    """Returns the first address of a host. Raises AddressUnknown, AddressRefused."""
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        raise AddressUnknown from None
    addresses = [str(one[4][0]) for one in found]
    if not addresses or not all(is_allowed(address, may_be_private=may_be_private) for address in addresses):
        raise AddressRefused
    return addresses[0]


def is_allowed(address: str, *, may_be_private: bool) -> bool:
    """Whether the tower may connect to this address. Where clouds keep metadata is never allowed."""
    try:
        ip = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return False
    if isinstance(ip, ipaddress.IPv6Address):
        if ip in _CARRIES_IPV4:
            ip = ipaddress.IPv4Address(int(ip) & 0xFFFFFFFF)
        else:
            ip = ip.ipv4_mapped or ip.sixtofour or ip
    if ip.is_multicast or ip.is_unspecified or ip.is_link_local or ip in _METADATA:
        return False
    if isinstance(ip, ipaddress.IPv6Address):
        is_global, is_private = ip.is_global and ip in _GLOBAL_IPV6, any(ip in network for network in _PRIVATE_IPV6)
    else:
        is_global, is_private = ip.is_global, ip.is_private or ip.is_loopback
    return is_global or (may_be_private and is_private)


class JudgedConnection(http.client.HTTPConnection):
    """Connects to the given address, and names the host in TLS and in the request."""

    def __init__(self, host: str, port: int, address: str, *, is_tls: bool) -> None:
        super().__init__(host, port, timeout=CONNECT_WITHIN_S)
        self.default_port = 443 if is_tls else 80
        self._address = address
        self._is_tls = is_tls
        self.is_cut = False
        self._socket: socket.socket | None = None
        """`http.client` forgets its own before a body without a length is read."""

    def connect(self) -> None:
        self.sock = self._socket = socket.create_connection((self._address, self.port), CONNECT_WITHIN_S)
        if self._is_tls:
            # The handshake comes after the assignment, so that `cut` reaches it.
            plain, context = self.sock, ssl.create_default_context()
            try:
                tls = context.wrap_socket(plain, server_hostname=self.host, do_handshake_on_connect=False)
                self.sock = self._socket = tls
                tls.do_handshake()
            except BaseException:
                plain.close()
                self.close()
                raise

    def cut(self) -> None:
        """Ends it from another thread: whoever reads gets an OSError, or the answer as if it were complete."""
        self.is_cut = True
        if self._socket is not None:
            with suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)
