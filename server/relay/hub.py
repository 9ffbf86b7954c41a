"""The hub: the one owner of live state. Links, drones, leases and browsers meet here and nowhere else.

Its laws:
- Every method is a plain `def`: nothing can happen between reading and writing, so there are no locks.
- It knows no database. What it believes of users, drones and leases is handed to it, newest wins.
- It never waits for anybody: what a browser or an agent cannot take at once waits in a bounded place of its own.
- A frame goes to those who may see its drone, and from the holder to the drone. Anything else is dropped and counted.
"""

from collections.abc import Callable, Iterable
from typing import Final

from server.accounts.tables import Role
from server.fleet.snapshot import DroneRecord, FleetSnapshot, UserRef
from server.fleet.views import DroneView
from server.relay import live_messages as live
from server.relay.agent_link import AgentLink
from server.relay.browser import Browser
from server.relay.downward import NEVER_FORWARDED, check_downward
from server.relay.live_drone import LeaseView, LiveDrone, lease_of
from server.relay.message_classes import is_stick_frame, state_key
from wire.content import Frames
from wire.control_messages import AutopilotState, ControlChanged, HoldOrder, HoldProgress
from wire.drops import DropCounts, Dropped, DropReason
from wire.frames import MalformedFrame, message_id
from wire.ids import DroneId, LinkId, UserId
from wire.tagged import LARGEST_UPWARD_MESSAGE_BYTES, split_tagged, tag

SESSION_ENDED: Final = 4401
GOING_DOWN: Final = 1001
LINK_REPLACED: Final = 4409
CREDENTIAL_GONE: Final = 4401

MANUAL_FOR_S: Final = 3.0
"""A drone counts as flown by hand for so long after the last stick frame: RC_OVERRIDE_TIME of the autopilots."""


class Hub:
    """See the module's laws. `now` is monotonic seconds everywhere."""

    def __init__(self) -> None:
        self.drops: DropCounts = DropCounts()
        self.on_hold_progress: Callable[[DroneId, HoldProgress], None] = lambda drone_id, progress: None
        self._drones: dict[DroneId, LiveDrone] = {}
        self._links: dict[LinkId, AgentLink] = {}
        self._browsers: dict[int, Browser] = {}
        self._next_browser = 0
        self._next_order = 0
        self._revision = -1

    # -- what the database says ------------------------------------------------------------------------------

    def apply_fleet(self, snapshot: FleetSnapshot) -> None:
        """Takes over drones, owners, accounts and leases. A snapshot older than the last one is ignored."""
        if snapshot.revision < self._revision:
            return
        self._revision = snapshot.revision
        records = {record.id: record for record in snapshot.drones}
        for drone_id in [known for known in self._drones if known not in records]:
            self._remove_drone(drone_id)
        for drone_id, record in records.items():
            self._put_drone(drone_id, record)
        for browser in list(self._browsers.values()):
            account = snapshot.users.get(browser.viewer.user_id)
            if account is None or account.disabled or account.role != browser.viewer.role:
                self._close_browser(browser)

    def _put_drone(self, drone_id: DroneId, record: DroneRecord) -> None:
        drone = self._drones.get(drone_id)
        if drone is None:
            drone = self._drones[drone_id] = LiveDrone(record, lease_of(record))
            self._admit_watchers(drone)
            return
        before = drone.view()
        if drone.link is not None and record.credential_hash != drone.record.credential_hash:
            drone.link.close(CREDENTIAL_GONE, "the drone has been given a new credential")
            self.detach_link(drone.link)
        drone.record = record
        # The lease in a snapshot may have been read before a change that has been applied meanwhile.
        if record.epoch >= drone.lease.epoch:
            newer = record.epoch > drone.lease.epoch
            drone.lease = lease_of(record)
            if newer:
                self._tell_agent_who_holds(drone)
        if drone.view() != before:
            self._tell_watchers_who_still_may_see(drone)
        self._admit_watchers(drone)

    def _remove_drone(self, drone_id: DroneId) -> None:
        drone = self._drones.pop(drone_id)
        if drone.link is not None:
            drone.link.close(CREDENTIAL_GONE, "the drone has been removed")
            self._links.pop(drone.link.link_id, None)
        for browser in drone.watchers.values():
            browser.outbox.forget(drone_id)
            browser.tell(live.DroneRemoved(drone_id))

    def _admit_watchers(self, drone: LiveDrone) -> None:
        for browser in self._browsers.values():
            allowed = drone.may_be_seen_by(browser.viewer.user_id, browser.viewer.role)
            if allowed and browser.number not in drone.watchers:
                drone.watchers[browser.number] = browser
                browser.tell(live.DroneChanged(drone.view()))
            elif not allowed and drone.watchers.pop(browser.number, None) is not None:
                browser.outbox.forget(drone.drone_id)
                browser.tell(live.DroneRemoved(drone.drone_id))

    def apply_lease(
        self, drone_id: DroneId, lease: LeaseView, *, event: str, by: UserRef | None, reason: str, now: float
    ) -> None:
        """Takes over a lease that has been committed. From this call on the old holder's frames are refused."""
        drone = self._drones.get(drone_id)
        # The epoch may be known already, if a snapshot was read between the commit and this call.
        if drone is None or lease.epoch < drone.lease.epoch:
            return
        drone.lease = lease
        drone.sticks_at = float("-inf")
        self._note_holder_presence(drone, now)
        self._tell_agent_who_holds(drone)
        self._tell_drone(drone)
        self._tell_watchers(drone, live.Control(drone_id, event, lease.epoch, lease.holder, by, reason))

    # -- what others ask -------------------------------------------------------------------------------------

    def drone_for(self, drone_id: DroneId, user_id: UserId, role: Role) -> LiveDrone | None:
        """The drone, or None both where it does not exist and where this user may not see it."""
        drone = self._drones.get(drone_id)
        return drone if drone is not None and drone.may_be_seen_by(user_id, role) else None

    def drones_for(self, user_id: UserId, role: Role) -> list[LiveDrone]:
        """What one user may see, by number."""
        return [drone for _, drone in sorted(self._drones.items()) if drone.may_be_seen_by(user_id, role)]

    def drone_view(self, drone_id: DroneId, user_id: UserId, role: Role) -> DroneView | None:
        """`drone_for`, as it is told to the outside."""
        drone = self.drone_for(drone_id, user_id, role)
        return drone.view() if drone else None

    def drone_views(self, user_id: UserId, role: Role) -> list[DroneView]:
        """`drones_for`, as it is told to the outside."""
        return [drone.view() for drone in self.drones_for(user_id, role)]

    def drone(self, drone_id: DroneId) -> LiveDrone | None:
        """Any drone, for those who have to act on it whoever asked."""
        return self._drones.get(drone_id)

    def flown_by_hand(self, drone: LiveDrone, now: float) -> bool:
        """Whether the holder's sticks have moved this drone within the last seconds."""
        return now - drone.sticks_at < MANUAL_FOR_S

    # -- browsers --------------------------------------------------------------------------------------------

    def next_browser_number(self) -> int:
        """A number for a Browser about to be attached."""
        self._next_browser += 1
        return self._next_browser

    def attach_browser(self, browser: Browser, server_time: str, now: float) -> None:
        """From here on the browser gets the frames of the drones it may see; the whole picture comes first."""
        self._browsers[browser.number] = browser
        viewer = browser.viewer
        seen = self.drones_for(viewer.user_id, viewer.role)
        for drone in seen:
            drone.watchers[browser.number] = browser
        user = live.User(viewer.user_id, viewer.name, viewer.role)
        browser.tell(live.WelcomeBrowser(user, [drone.view() for drone in seen], server_time))
        self._note_presence_of(viewer.user_id, now)

    def detach_browser(self, browser: Browser, now: float) -> None:
        """The browser is gone. Harmless if it was gone already."""
        if self._browsers.pop(browser.number, None) is None:
            return
        for drone in self._drones.values():
            drone.watchers.pop(browser.number, None)
        self._note_presence_of(browser.viewer.user_id, now)

    def end_sessions(self, session_ids: Iterable[int]) -> None:
        """Closes the browsers of sessions that have ended."""
        ended = set(session_ids)
        for browser in [one for one in self._browsers.values() if one.viewer.session_id in ended]:
            self._close_browser(browser)

    def end_user(self, user_id: UserId) -> None:
        """Closes every browser of an account."""
        for browser in [one for one in self._browsers.values() if one.viewer.user_id == user_id]:
            self._close_browser(browser)

    def say_good_bye(self) -> None:
        """The tower is going down: everybody is told, so that they come back instead of wondering."""
        for browser in self._browsers.values():
            browser.close(GOING_DOWN, "the tower is going down")
        for link in self._links.values():
            link.close(GOING_DOWN, "the tower is going down")

    def _close_browser(self, browser: Browser) -> None:
        # Nothing more goes out or comes in from this instant; the socket's own end is only a formality.
        self._browsers.pop(browser.number, None)
        for drone in self._drones.values():
            drone.watchers.pop(browser.number, None)
        browser.close(SESSION_ENDED, "signed out")

    def focus(self, browser: Browser, drone_id: DroneId | None, now: float) -> None:
        """The browser wants the frames of one drone at once."""
        drone = self._drones.get(drone_id) if drone_id is not None else None
        if drone_id is not None and (drone is None or browser.number not in drone.watchers):
            self._refuse(browser, DropReason.UNKNOWN_DRONE, drone_id, now)
            return
        browser.outbox.focus = drone_id

    def frames_from_browser(self, browser: Browser, message: bytes, now: float) -> None:
        """A binary message: checks each frame in turn and passes on those of a holder to their own drone."""
        if browser.number not in self._browsers:
            return
        try:
            if len(message) > LARGEST_UPWARD_MESSAGE_BYTES:
                raise MalformedFrame("too long")
            parts = split_tagged(message)
        except MalformedFrame:
            self._refuse(browser, DropReason.MALFORMED, None, now)
            return
        for drone_id, frame in parts:
            try:
                self._frame_down(browser, drone_id, frame, now)
            except Dropped as dropped:
                self._refuse(browser, dropped.reason, drone_id, now)

    def _frame_down(self, browser: Browser, drone_id: DroneId, frame: bytes, now: float) -> None:
        drone = self._drones.get(drone_id)
        check_downward(drone, browser, frame, now)
        assert drone is not None
        assert drone.link is not None
        if not drone.link.send_frames(drone.lease.epoch, (frame,), now):
            raise Dropped(DropReason.OFFLINE)
        if is_stick_frame(frame):
            drone.sticks_at = now

    def _refuse(self, browser: Browser, reason: DropReason, drone_id: DroneId | None, now: float) -> None:
        self.drops[reason] += 1
        drone = self._drones.get(drone_id) if drone_id is not None else None
        # The name of a drone that this browser may not see must not get into the answer.
        name = drone.record.name if drone is not None and browser.number in drone.watchers else ""
        browser.refuse(reason, drone_id, name, now)

    # -- agents ----------------------------------------------------------------------------------------------

    def attach_link(self, link: AgentLink) -> None:
        """An agent signed in. A link that its drone already had is closed: the newest one counts."""
        drone = self._drones[link.drone_id]
        if drone.link is not None:
            drone.link.close(LINK_REPLACED, "the same drone has signed in again")
            self.detach_link(drone.link)
        drone.link = link
        self._links[link.link_id] = link

    def detach_link(self, link: AgentLink) -> None:
        """The link is gone. Harmless if it was gone already or has been replaced."""
        self._links.pop(link.link_id, None)
        drone = self._drones.get(link.drone_id)
        if drone is not None and drone.link is link:
            drone.link = None
            drone.autopilot_heard = drone.armed = drone.airborne = False
            drone.online = False
            self._tell_drone(drone)

    def has_link_id(self, link_id: LinkId) -> bool:
        """Whether a live link has this number."""
        return link_id in self._links

    def datagram(self, datagram: bytes, link_id: LinkId, address: tuple[str, int], now: float) -> None:
        """A datagram that claims to be of `link_id`. Raises Dropped with the check that it failed."""
        link = self._links.get(link_id)
        if link is None:
            raise Dropped(DropReason.UNKNOWN_LINK)
        received = link.sealed.receive(datagram, now)
        if received.newest:
            link.address = address
        link.send_keepalives(now)
        drone = self._drones[link.drone_id]
        if not drone.online:
            drone.online = True
            self._tell_drone(drone)
        if received.frames is not None:
            self._frames_up(drone, received.frames)

    def _frames_up(self, drone: LiveDrone, content: Frames) -> None:
        if content.drone_id != drone.drone_id:
            raise Dropped(DropReason.FOREIGN_TAG)
        drone_id = drone.drone_id
        watchers = drone.watchers.values()
        for frame in content.frames:
            if message_id(frame) in NEVER_FORWARDED:
                self.drops[DropReason.NOT_ALLOWED] += 1
                continue
            key = state_key(frame)
            tagged = tag(drone_id, frame)
            for browser in watchers:
                browser.offer(drone_id, key, tagged)

    def autopilot_state(self, link: AgentLink, state: AutopilotState) -> None:
        """The agent tells what its autopilot is doing."""
        drone = self._drones.get(link.drone_id)
        if drone is None or drone.link is not link:
            return
        drone.armed, drone.airborne = state.armed, state.airborne
        if drone.autopilot_heard != state.heard:
            drone.autopilot_heard = state.heard
            self._tell_drone(drone)

    # -- holds -----------------------------------------------------------------------------------------------

    def order_hold(self, drone_id: DroneId, reason: str) -> bool:
        """Tells the agent to hold, and everybody that it was ordered. False if there is no agent to tell."""
        drone = self._drones.get(drone_id)
        if drone is None:
            return False
        epoch = drone.lease.epoch
        if drone.link is None:
            self._tell_watchers(drone, live.Hold(drone_id, epoch, "unconfirmed", "the drone is offline", 0.0))
            return False
        self._next_order += 1
        drone.link.post(HoldOrder(order_id=self._next_order, epoch=epoch, reason=reason))
        self._tell_watchers(drone, live.Hold(drone_id, epoch, "ordered", reason, 0.0))
        return True

    def hold_progress(self, link: AgentLink, progress: HoldProgress) -> None:
        """The agent tells how a hold goes on."""
        drone = self._drones.get(link.drone_id)
        if drone is None or drone.link is not link:
            return
        told = live.Hold(drone.drone_id, progress.epoch, progress.step, progress.detail, progress.elapsed_ms)
        self._tell_watchers(drone, told)
        self.on_hold_progress(drone.drone_id, progress)

    # -- telling ---------------------------------------------------------------------------------------------

    def _tell_watchers(self, drone: LiveDrone, event: live.ToBrowser) -> None:
        for browser in drone.watchers.values():
            browser.tell(event)

    def _tell_watchers_who_still_may_see(self, drone: LiveDrone) -> None:
        for browser in drone.watchers.values():
            if drone.may_be_seen_by(browser.viewer.user_id, browser.viewer.role):
                browser.tell(live.DroneChanged(drone.view()))

    def _tell_drone(self, drone: LiveDrone) -> None:
        self._tell_watchers(drone, live.DroneChanged(drone.view()))

    def _tell_agent_who_holds(self, drone: LiveDrone) -> None:
        if drone.link is None:
            return
        drone.link.post(
            ControlChanged(
                epoch=drone.lease.epoch,
                holder=drone.lease.holder.name if drone.lease.holder else None,
                holder_present=self.holder_present(drone),
            )
        )

    # -- presence and time -----------------------------------------------------------------------------------

    def holder_present(self, drone: LiveDrone) -> bool:
        """Whether the holder has a live browser."""
        return any(browser.viewer.user_id == drone.holder_id for browser in drone.watchers.values())

    def _note_presence_of(self, user_id: UserId, now: float) -> None:
        for drone in self._drones.values():
            if drone.holder_id == user_id:
                self._note_holder_presence(drone, now)
                self._tell_agent_who_holds(drone)

    def _note_holder_presence(self, drone: LiveDrone, now: float) -> None:
        if drone.holder_id is None or self.holder_present(drone):
            drone.holder_missing_since = None
        elif drone.holder_missing_since is None:
            drone.holder_missing_since = now

    def tick(self, now: float) -> None:
        """Several times a second: keep-alives, silence, and sums of refusals."""
        for drone in self._drones.values():
            link = drone.link
            if link is None:
                continue
            link.send_keepalives(now)
            if drone.online and not link.is_heard(now):
                drone.online = False
                self._tell_drone(drone)
        for browser in self._browsers.values():
            for notice in browser.refusals.due(now):
                browser.tell(notice)

    def tell_link_quality(self) -> None:
        """Once a second: round trip and loss of every drone that is online."""
        for drone in self._drones.values():
            if drone.link is None or not drone.online:
                continue
            keepalive = drone.link.sealed.keepalive
            rtt_ms = None if keepalive.rtt_s is None else round(keepalive.rtt_s * 1000, 1)
            self._tell_watchers(drone, live.LinkQuality(drone.drone_id, rtt_ms, round(keepalive.loss, 3)))
