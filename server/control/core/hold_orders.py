"""Orders to hold and to stay: numbered, sent to the agent at once, reported to all who may see the drone."""

from typing import Final

from server.live import live_messages as live
from server.live.live_state import LiveState
from wire.control_messages import HoldOrder
from wire.ids import DroneId
from wire.open_holds import Stay

MAX_ORDERS_OPEN: Final = 8
MAX_NAME: Final = 80
"""Characters of a name that an agent takes."""

OFFLINE: Final = "the drone is offline: the hold is ordered when it is back."


class HoldOrders:
    """One for the hub. The drone keeps the reasons of open orders.

    `number_after`: the first order has the next number. Numbers also grow across restarts of the tower: an agent's
    answer to an old order must not match a new one.
    """

    def __init__(self, state: LiveState, *, number_after: int) -> None:
        self._state = state
        self._last_order = number_after & 0xFFFFFFFF

    def order(self, drone_id: DroneId, reason: str, *, interrupts: bool = False) -> bool:
        """`interrupts`: also a return or a landing that the autopilot flies. False if there is no agent to tell: it is
        owed until there is one."""
        drone = self._state.drones.get(drone_id)
        if drone is None:
            return False
        epoch, link = drone.lease.epoch, drone.link
        drone.commanded += 1
        if link is None:
            drone.open_hold.ordered()
            self._state.note_hold(drone)
            words = " ".join(filter(None, (OFFLINE, drone.open_hold.last_words())))
            self._state.notify_watchers(drone, live.Hold(drone_id, epoch, "unconfirmed", words, 0.0, "order"))
            return False
        order_id = self._next()
        self._state.traffic.holds_ordered += 1
        if len(drone.orders) >= MAX_ORDERS_OPEN:
            del drone.orders[next(iter(drone.orders))]
        drone.orders[order_id] = reason
        interrupts = interrupts or link.interrupts
        link.send_urgent(HoldOrder(order_id=order_id, epoch=epoch, reason=reason, interrupts=interrupts))
        if link.knows_open_holds:
            drone.open_hold.ordered(order_id)
            self._state.note_hold(drone)
        self._state.notify_watchers(drone, live.Hold(drone_id, epoch, "ordered", reason, 0.0, "order"))
        return True

    def order_where_flown_by_hand(self, reason: str, now: float) -> None:
        """Orders a hold for each drone that is flown with sticks."""
        for drone_id, drone in list(self._state.drones.items()):
            if drone.flown_by_hand(now):
                self.order(drone_id, reason)

    def keep(self, drone_id: DroneId) -> None:
        """A hold of a tower before this one, as it is written down: it is owed to the drone."""
        drone = self._state.drones.get(drone_id)
        if drone is not None:
            drone.open_hold.ordered()
            drone.hold_noted = True

    def stay(self, drone_id: DroneId, by: str) -> bool:
        """False if there is no agent to tell."""
        drone = self._state.drones.get(drone_id)
        if drone is None or drone.link is None:
            return False
        drone.link.send_urgent(Stay(order_id=self._next(), by=by[:MAX_NAME]))
        return True

    def _next(self) -> int:
        self._last_order = (self._last_order + 1) & 0xFFFFFFFF
        return self._last_order
