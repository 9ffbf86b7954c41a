"""Holders whose right has ended, until the database has ended their lease.

Their commands pass no more from the instant the hub notices. If the database has not ended the lease 0.1 s later, the
drone holds without it.
"""

import asyncio

from server.control.store.service import ControlService
from server.control.store.undecided import DECIDED_WITHIN_S
from server.live.hub import Hub
from server.live.hub_events import HubEvent, RightLost


class PendingRevocations:
    """One for the event handler. Needs a running loop."""

    def __init__(self, service: ControlService, hub: Hub) -> None:
        self._service = service
        self._hub = hub
        self._open: dict[RightLost, asyncio.TimerHandle | None] = {}
        """With the timer of its hold; None after the order."""

    def begin(self, event: HubEvent) -> bool:
        """Shuts the holder out, until `end`. False for another event, or if they already are."""
        if not isinstance(event, RightLost) or event.whose != "holder":
            return False
        drone = self._hub.state.drones.get(event.drone_id)
        if drone is None or drone.holder_id != event.user_id:
            return False
        if any((one.drone_id, one.user_id) == (event.drone_id, event.user_id) for one in self._open):
            return False
        self._service.fence(event.drone_id)
        self._open[event] = asyncio.get_running_loop().call_later(DECIDED_WITHIN_S, self.hold, event)
        return True

    def __contains__(self, event: HubEvent) -> bool:
        """Whether its holder is shut out."""
        return isinstance(event, RightLost) and event in self._open

    def hold(self, event: HubEvent) -> None:
        """The database does not answer: the drone holds now. Only once for each event."""
        if not isinstance(event, RightLost):
            return
        timer = self._open.get(event)
        if timer is None:
            return
        timer.cancel()
        self._open[event] = None
        reason = f"the holder may not fly ({event.reason}), and the database has not confirmed it yet"
        self._hub.holds.order(event.drone_id, reason)
        self._hub.changes.notify_undecided(event.drone_id, "warning", f"{reason}: nobody's commands pass until it has.")

    def end(self, event: HubEvent) -> None:
        """The lease has been decided."""
        if isinstance(event, RightLost) and event in self._open:
            timer = self._open.pop(event)
            if timer is not None:
                timer.cancel()
            self._service.unfence(event.drone_id)
