"""The one table of limits before sign-in. docs/anonymous-budget.md repeats it; a test compares.

A client is counted by its IPv4 address or its IPv6 /64, because one host has the whole /64: "address" below. The
"network" around it is the /24 or the /48. "Known" is an address with an earlier sign-in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True)
class AnonymousLimits:
    """Durations in seconds, sizes in bytes."""

    # -- one request
    max_head_bytes: int = 16 * 1024
    max_headers: int = 100
    head_within_s: float = 10.0
    """A browser opens connections ahead of time; one that is closed is opened again when it is needed."""
    max_pipelined_requests: int = 4
    """Behind one that is not answered yet. Browsers send none; each costs as much as a request, though it is short."""
    max_sign_in_body_bytes: int = 16 * 1024
    """`POST /session`, `/session/passkey` and `/enrol`: the only bodies read from strangers."""
    sign_in_body_within_s: float = 10.0
    max_body_bytes: int = 64 * 1024
    """No other request of the API comes near; whatever does is a mistake or an attack."""
    max_plan_body_bytes: int = 512 * 1024
    """Mission, fence and rally points of 724 items each, or 4096 parameters, with room to be written widely. Such a
    body is read only when it is known who sends it."""
    body_within_s: float = 30.0
    """Time to complete a body. Half a megabyte needs 4 s at 1 Mbit/s. Without a limit, a client that sends byte by byte
    would keep memory and a connection for ever."""
    body_spread_s: float = 2.0
    """Added to either, by chance: 200 bodies that were given up together delayed a frame by 25 ms."""

    # -- connections that have not signed in
    max_connections_per_address: int = 100
    """A browser opens six; a few dozen may be behind one address."""
    max_connections_per_network: int = 200
    max_connections: int = 600
    """For unknown addresses. Beyond it, the network with the most connections loses its oldest one."""
    known_address_factor: int = 4
    """Multiplies the limits of a known address."""
    accept_slice_s: float = 0.002
    accept_rest_s: float = 0.006
    """Longest time of the event loop that accepting takes before it pauses."""
    receive_buffer_bytes: int = 8 * 1024
    """The kernel's buffer of a connection. An event loop reads all that a connection has sent before anything decides
    what becomes of it: a hundred floods at once were megabytes a round."""
    admitted_receive_buffer_bytes: int = 1024 * 1024
    """After sign-in: 40 Mbit/s over a round trip of 200 ms. The kernel may allow less (net.core.rmem_max)."""

    # -- bytes and requests, in fair turns between networks
    read_slice_s: float = 0.002
    read_rest_s: float = 0.008
    read_turn_bytes: int = 4 * 1024
    handshake_turn_bytes: int = 1024
    """Parsed at once: 680 chunks of a byte, or 170 pings, take a millisecond."""
    max_unread_bytes: int = 2 * 1024 * 1024
    """For all anonymous connections that wait to be parsed."""
    requests_per_s: float = 100.0
    requests_burst: float = 4.0
    """Requests that begin, of all addresses that are not known together. The rest waits."""
    known_requests_per_s: float = 200.0
    known_requests_burst: float = 10.0
    """For one known address. The rest waits with the others."""
    max_waiting_requests_per_address: int = 64
    max_waiting_requests_per_network: int = 128
    max_waiting_requests: int = 512
    request_wait_s: float = 8.0
    max_handshakes_per_address: int = 64
    max_handshakes: int = 256
    """WebSockets whose sign-in has not been checked, and agents whose hello has not come."""
    max_handshake_bytes: int = 16 * 1024
    """What such a WebSocket may send. A hello has one kilobyte."""

    # -- hashing of passwords
    known_hash_slots: int = 1
    """Of TOWER_ARGON2_CONCURRENCY threads. With one thread, known addresses go first."""
    max_waiting_hashes_per_address: int = 4
    max_waiting_hashes_per_network: int = 8
    max_waiting_hashes: int = 64
    hash_wait_s: float = 8.0
    guesses_per_name_per_hour: int = 100
    """At one name, from all addresses together from which its owner has not signed in before."""
    max_known_addresses: int = 10_000

    # -- the rest
    log_lines_per_s: float = 1.0
    log_lines_burst: float = 20.0
    """What is beyond is summed up in the next line."""
    junk_datagrams_per_s: float = 500.0
    """Datagrams of no link that are looked at for what is wrong with them. The rest is only counted."""


LIMITS: Final = AnonymousLimits()
