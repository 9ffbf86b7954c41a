"""Orders to hold: numbered, sent to the agent at once, told to everybody who may see the drone."""

from typing import Final

from server.relay import live_messages as live
from server.relay.live_state import LiveState
from wire.control_messages import HoldOrder
from wire.ids import DroneId

MOST_ORDERS_OPEN: Final = 8


class HoldOrders:
    """One for the hub. The reasons of open orders are kept with the drone."""

    def __init__(self, state: LiveState) -> None:
        self._state = state
        self._last_order = 0

    def order(self, drone_id: DroneId, reason: str) -> bool:
        """False if there is no agent to tell."""
        drone = self._state.drones.get(drone_id)
        if drone is None:
            return False
        epoch = drone.lease.epoch
        drone.commanded += 1
        if drone.link is None:
            told = live.Hold(drone_id, epoch, "unconfirmed", "the drone is offline", 0.0, "order")
            self._state.tell_watchers(drone, told)
            return False
        self._last_order += 1
        self._state.traffic.holds_ordered += 1
        if len(drone.orders) >= MOST_ORDERS_OPEN:
            del drone.orders[min(drone.orders)]
        drone.orders[self._last_order] = reason
        drone.link.send_urgent(HoldOrder(order_id=self._last_order, epoch=epoch, reason=reason))
        self._state.tell_watchers(drone, live.Hold(drone_id, epoch, "ordered", reason, 0.0, "order"))
        return True
