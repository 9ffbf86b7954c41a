"""POST to a server that a user named: a judged address, no redirects, and a limit for the whole call. Blocks."""

from __future__ import annotations

import http.client
import threading
from collections.abc import Mapping
from typing import Final
from urllib.parse import urlsplit

from server.alerts.io.message import NotSent
from server.runtime.judged_connection import AddressRefused, AddressUnknown, JudgedConnection, judged_address

MAX_ANSWER_BYTES: Final = 4096
WITHIN_S: Final = 10.0
"""For each read."""
IN_ALL_S: Final = 20.0
"""For the whole call. Without it a server that sends a byte now and then keeps the thread for hours."""
USER_AGENT: Final = "ControlTower/1 (alerts)"


def post(url: str, body: bytes, headers: Mapping[str, str], *, may_be_private: bool) -> int:
    """Returns the status of the answer. Raises NotSent if there is none."""
    parts = urlsplit(url)
    host, is_tls = parts.hostname or "", parts.scheme == "https"
    port = parts.port or (443 if is_tls else 80)
    try:
        address = judged_address(host, port, may_be_private=may_be_private)
    except AddressUnknown:
        raise NotSent("the name of the server is not known") from None
    except AddressRefused:
        raise NotSent("the server is in a private network") from None
    connection = JudgedConnection(host, port, address, is_tls=is_tls)
    deadline = threading.Timer(IN_ALL_S, connection.cut)
    deadline.daemon = True
    deadline.start()
    target = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
    try:
        connection.connect()
        connection.sock.settimeout(WITHIN_S)
        connection.request("POST", target, body, {"User-Agent": USER_AGENT, **headers})
        with connection.getresponse() as answer:
            answer.read(MAX_ANSWER_BYTES)
    except (OSError, http.client.HTTPException, ValueError) as error:
        if not connection.is_cut:
            raise NotSent(f"the server cannot be reached ({type(error).__name__})") from None
    finally:
        deadline.cancel()
        connection.close()
    if connection.is_cut:
        raise NotSent("the other side is too slow")
    return answer.status
