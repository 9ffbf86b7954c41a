"""What is live right now: drones, links, browsers, and telling them things. Held by the hub, shared with its parts.

Nothing here decides anything. Every method is plain and returns at once.
"""

from collections.abc import Callable, Iterable
from collections.abc import Set as AbstractSet
from datetime import datetime
from typing import Final

from msgspec import Raw
from msgspec.structs import replace

from server.airspace.core.separation.elsewhere import DronesElsewhere
from server.kernel.clock import Clock
from server.kernel.fair_queue import FairQueue
from server.kernel.relations import Right
from server.kernel.shares import Shares
from server.link.core.agent_link import AgentLink
from server.link.core.flood_gate import FLOODING
from server.link.core.traffic import Traffic
from server.live import live_messages as live
from server.live.browser import Browser
from server.live.hub_events import HoldToKeep, HubEvent
from server.live.live_drone import MANUAL_FOR_S, LiveDrone, Viewpoint
from server.live.open_browsers import OpenBrowsers
from server.towers.core.place import Place
from wire.control_messages import ControlChanged, ToAgent
from wire.drops import DropCounts, DropReason
from wire.frames import payload
from wire.ids import DroneId, LinkId, UserId
from wire.open_holds import LostAction

MAX_PUBLISHED_AT_ONCE: Final = 10
"""Drones of which `publish_soon` tells in one piece. The rest waits for a turn of the event loop: when a machine with a
hundred agents fails, all of them fall silent in the same tick."""
MAX_AIRCRAFT_FRAMES: Final = 200
"""Of one drone that wait."""


def _raise(part: str, drone_id: DroneId | None, error: Exception) -> None:
    raise error


class LiveState:
    """The dictionaries of the hub."""

    def __init__(self, clock: Clock, shares: Shares | None = None) -> None:
        self.clock = clock
        """The time of day, for people."""
        self.drones: dict[DroneId, LiveDrone] = {}
        self.links: dict[LinkId, AgentLink] = {}
        self.browsers = OpenBrowsers()
        self._to_publish: dict[DroneId, LiveDrone] = {}
        self._publish_now = MAX_PUBLISHED_AT_ONCE
        self.drops: DropCounts = DropCounts()
        self.traffic = Traffic()
        self.shares = shares or Shares()
        """What people, drones and teams may have of what all share."""
        self.elsewhere = DronesElsewhere()
        """Drones in the air at other towers."""
        self.aircraft_frames: FairQueue[DroneId, tuple[bytes, float]] = FairQueue(MAX_AIRCRAFT_FRAMES)
        """What receivers on board heard and nobody has read yet, and when; a flood loses its own oldest."""
        self.sticks_at = float("-inf")
        """When the last stick frame of any user was forwarded."""
        self.place_of: Callable[[DroneId], Place] = lambda drone_id: Place.HERE
        """The place of a drone that was not known before."""
        self.on_event: Callable[[HubEvent], None] = lambda event: None
        """Whoever acts on what the hub notices."""
        self.on_fault: Callable[[str, DroneId | None, Exception], None] = _raise
        """An error of ours in this part of the tower, while it looked at this drone: all others go on."""
        self.on_told: Callable[[LiveDrone, live.ToBrowser], None] = lambda drone, event: None
        """Whoever remembers what all who may see a drone were told."""

    def anybody_flies_by_hand(self, now: float) -> bool:
        """Whether sticks have moved any drone within the last seconds."""
        return now - self.sticks_at < MANUAL_FOR_S

    def frame_watchers_of(self, drone: LiveDrone) -> list[Browser]:
        """Browsers that get its frames, from this tower or from its home."""
        if drone.place is Place.HERE:
            return drone.frame_watchers()
        known, barred = self.elsewhere.get(drone.drone_id), {drone.user_without_view}
        if known is not None:
            barred.add(known.without_view)
        return [
            browser
            for browser in self.browsers.values()
            if browser.viewer.user_id not in barred
            and drone.may(browser.viewer.user_id, browser.viewer.role, Right.SEE)
        ]

    def notify_watchers(self, drone: LiveDrone, event: live.ToBrowser) -> None:
        """Notifies all who may see the drone."""
        self.on_told(drone, event)
        for browser in drone.watchers.values():
            browser.notify(event)

    def notify_video_watchers(self, drone: LiveDrone, event: live.ToBrowser, *, of: datetime) -> None:
        """Notifies all who may watch the drone's video, about something that began at that time."""
        shut_out = drone.no_video_user_id
        for browser in drone.watchers.values():
            viewer = browser.viewer
            if viewer.user_id != shut_out and drone.knows_of(viewer.user_id, viewer.role, of):
                browser.notify(event)

    def notify_former_viewers(self, drone: LiveDrone, user_ids: AbstractSet[UserId], event: live.ToBrowser) -> None:
        """A last word to those who may not see the drone any more, and had a part in it until now."""
        for browser in self.browsers.values():
            if browser.viewer.user_id in user_ids and browser.number not in drone.watchers:
                browser.notify(event)

    def publish_soon(self, drone: LiveDrone) -> None:
        """The same as `publish_drone` for what time changes about many drones at once: beyond MAX_PUBLISHED_AT_ONCE in
        the next slice."""
        if self._publish_now > 0:
            self._publish_now -= 1
            self.publish_drone(drone)
        else:
            self._to_publish[drone.drone_id] = drone

    def publish_waiting(self) -> bool:
        """Publishes a slice of those that wait. Whether more do."""
        self._publish_now = MAX_PUBLISHED_AT_ONCE
        for drone_id in list(self._to_publish)[:MAX_PUBLISHED_AT_ONCE]:
            drone = self._to_publish[drone_id]
            self._publish_now -= 1
            if self.drones.get(drone_id) is drone:
                self.publish_drone(drone)
            else:
                del self._to_publish[drone_id]
        return bool(self._to_publish)

    def publish_drone(self, drone: LiveDrone) -> None:
        """The drone as it is now. One event for all who stand to it alike: it is put into JSON once."""
        self._to_publish.pop(drone.drone_id, None)
        events: dict[Viewpoint, live.DroneChanged] = {}
        for browser in drone.watchers.values():
            standpoint = drone.standpoint_of(browser.viewer.user_id, browser.viewer.role)
            event = events.get(standpoint)
            if event is None:
                event = events[standpoint] = live.DroneChanged(drone.view_as(standpoint))
            browser.notify(event)

    def publish_links(self, drones: Iterable[LiveDrone], now: float) -> None:
        """How the links of those are that are online: to each browser in one message."""
        events: dict[int, list[Raw]] = {}
        for drone in drones:
            if drone.link is not None and drone.online and drone.watchers:
                quality = live.encode_quality(drone.link.quality(now))
                for number in drone.watchers:
                    events.setdefault(number, []).append(quality)
        for number, links in events.items():
            self.browsers[number].notify(live.Links(links))

    def send_to_agent(self, drone: LiveDrone, message: ToAgent) -> None:
        """If there is one."""
        if drone.link is not None:
            drone.link.post(message)

    def note_hold(self, drone: LiveDrone) -> None:
        """Whether a hold must be ordered again on the next link may have changed. That is to outlive the tower."""
        must_be_ordered = drone.open_hold.must_be_ordered
        if drone.hold_noted != must_be_ordered:
            drone.hold_noted = must_be_ordered
            self.on_event(HoldToKeep(drone.drone_id))

    def send_safety_to_agent(self, drone: LiveDrone) -> None:
        """How the drone holds, in words that its agent knows: an older one has no "stay", and would end the channel."""
        settings = drone.safety
        if drone.link is not None and not drone.link.knows_open_holds and settings.lost_action is LostAction.STAY:
            settings = replace(settings, lost_action=LostAction.CONTINUE)
        self.send_to_agent(drone, settings)

    def send_holder_to_agent(self, drone: LiveDrone) -> None:
        """Epoch, holder, and whether they are there. On both channels: a control channel may be lost unnoticed."""
        if drone.link is None:
            return
        holder = drone.lease.holder
        drone.link.send_urgent(
            ControlChanged(
                number=drone.link.next_number(),
                epoch=drone.lease.epoch,
                holder=holder.name if holder else None,
                holder_present=drone.somebody_flies(),
                assistant_flies=drone.lease.assistant is not None and drone.turn.whose == "assistant",
            ),
        )

    def refuse(
        self, browser: Browser, reason: DropReason, drone_id: DroneId | None, now: float, words: str = ""
    ) -> None:
        """Counts a refused frame and answers its sender. `words`: the limit of a loan."""
        self.drops[reason] += 1
        self.traffic.refusals[reason.value] += 1
        drone = self.drones.get(drone_id) if drone_id is not None else None
        # The name of a drone that this browser may not see must not get into the answer.
        name = drone.record.name if drone is not None and browser.number in drone.watchers else ""
        browser.refuse(reason, drone_id, name, now, words)
        if reason is DropReason.FLOOD and not browser.patience.take(1.0, now):
            browser.end(FLOODING, "too much was sent for too long")

    def mode_of(self, drone_id: DroneId) -> int | None:
        """The custom mode of the newest heartbeat; None where there was none."""
        drone = self.drones.get(drone_id)
        heartbeat = None if drone is None else drone.heartbeat
        return None if heartbeat is None else int.from_bytes(payload(heartbeat)[:4], "little")

    def has_browser(self, user_id: UserId) -> bool:
        """Whether this user has any live browser that may fly."""
        return any(browser.viewer.may_fly for browser in self.browsers.of_user(user_id))
