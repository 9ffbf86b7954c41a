"""Notifies systemd of readiness, liveness and status. Does nothing if systemd did not start the agent."""

from __future__ import annotations

import contextlib
import os
import socket
from typing import ClassVar, Final
from weakref import WeakSet

LINKED: Final = "X_TOWER_LINKED=1"
"""To the launcher of a release on trial (onboard_agent.update.launch); systemd ignores it."""
ARMED: Final = "armed"
"""The last word of the status line while the drone is armed."""


def service_status(*, linked: bool, heard: bool, armed: bool) -> str:
    """The line of `systemctl status`. Packages and `tower-agent install` read in it whether the drone is armed."""
    tower = "linked" if linked else "not reached"
    autopilot = "heard" if heard else "silent"
    return f"tower {tower}, autopilot {autopilot}, {ARMED if armed else 'disarmed'}"


class Systemd:
    """Wraps the notification socket and the watchdog's interval. `speaks`: False for an agent beside another one in
    this process, which speaks for both."""

    _armed_beside: ClassVar[WeakSet[Systemd]] = WeakSet()
    """Of agents in this process that do not speak: those whose drone is armed."""

    def __init__(self, *, speaks: bool = True) -> None:
        self._speaks = speaks
        self._address = _address(os.environ.get("NOTIFY_SOCKET", "")) if speaks else None
        self._socket = None if self._address is None else socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        if self._socket is not None:
            self._socket.setblocking(False)
        self._status = ""
        watchdog_us = os.environ.get("WATCHDOG_USEC", "")
        self._beat_s = int(watchdog_us) / 3e6 if watchdog_us.isdecimal() and int(watchdog_us) else None
        self._next_beat = 0.0

    def _notify(self, text: str) -> None:
        if self._socket is not None and self._address is not None:
            with contextlib.suppress(OSError):  # systemd reads late, or is gone: flying goes on
                self._socket.sendto(text.encode(), self._address)

    def ready(self) -> None:
        """The settings are valid and the agent works, whether or not the tower responds."""
        self._notify("READY=1")

    def linked(self) -> None:
        """There is a link with the tower."""
        self._notify(LINKED)

    def stopping(self) -> None:
        """The agent is shutting down."""
        self._notify("STOPPING=1")

    def alive(self, now: float) -> None:
        """Call it from the loop that must not hang."""
        if self._beat_s is not None and now >= self._next_beat:
            self._next_beat = now + self._beat_s
            self._notify("WATCHDOG=1")

    def status(self, *, linked: bool, heard: bool, armed: bool) -> None:
        """Sends one line for `systemctl status`, only when it changes. It says armed if any drone of this process is:
        a restart would end all their agents."""
        if not self._speaks:
            (self._armed_beside.add if armed else self._armed_beside.discard)(self)
            return
        text = service_status(linked=linked, heard=heard, armed=armed or bool(self._armed_beside))
        if text != self._status:
            self._status = text
            self._notify(f"STATUS={text}")


def _address(text: str) -> str | None:
    """Returns the socket's address; `@` stands for the byte 0 of an abstract one. None: there is no socket."""
    return "\0" + text[1:] if text.startswith("@") else text or None
