"""Timers of the hub: missing holders, long round trips, turns, offers. Called several times a second with `now`.

It decides nothing about the lease: it reports events (hub_events).
"""

from typing import Final

from server.control.core.loan_limits import Home, whole_place_in
from server.live import live_messages as live
from server.live.hub_events import (
    HolderExpired,
    HolderGone,
    LoanLimitPassed,
    OfferLapsed,
    RttTooLong,
    TurnRequested,
)
from server.live.live_drone import LiveDrone
from server.live.live_state import LiveState
from server.towers.core.place import Place
from wire.ids import UserId

OFFER_LAPSES_AFTER_S: Final = 60.0

CLOSE_FOR_S: Final = 60.0
"""The tower keeps pinging this long after the last lease: longer than any hold lasts."""


class SafetyWatch:
    """One for the hub."""

    def __init__(self, state: LiveState) -> None:
        self._state = state

    def tick(self, now: float) -> None:
        """Everything that time alone can change."""
        flying: set[UserId] = set()
        for drone in list(self._state.drones.values()):
            lease = drone.lease
            try:
                # Nobody flies most drones of a large fleet: ten times a second they cost no more than these lines.
                # Lease and record are frozen, so the same ones still say that.
                if lease is drone.settled_lease and drone.record is drone.settled_record:
                    link = drone.link
                    if link is not None and link.wants_time(now):
                        self._watch_link(drone, now)
                    continue
                flying.update(user.id for user in (lease.holder, lease.assistant) if user is not None)
                self._watch(drone, now)
            except Exception as error:
                self._state.on_fault("safety", drone.drone_id, error)
        for browser in list(self._state.browsers.values()):
            for notice in browser.refusals.due(now):
                browser.notify(notice)
            if browser.viewer.user_id in flying and browser.viewer.may_fly:
                sequence = browser.trip.ping_due(now)
                if sequence is not None:
                    browser.notify(live.Ping(sequence))

    def _watch(self, drone: LiveDrone, now: float) -> None:
        lease = drone.lease
        if (
            lease.holder is None
            and lease.assistant is None
            and not lease.offered
            and not drone.record.loans
            and now > drone.close_until
        ):
            # After this last look, which takes everything back.
            drone.settled_lease, drone.settled_record = lease, drone.record
        else:
            drone.settled_lease = None
        self._watch_link(drone, now)
        if drone.place is not Place.HERE:
            return  # its home watches over it
        self.note_presence(drone, now)
        self._watch_holder(drone, now)
        self._watch_round_trip(drone, now)
        self._watch_turn_and_offer(drone, now)
        if drone.record.loans:
            self._watch_loan(drone, now)

    def note_presence(self, drone: LiveDrone, now: float) -> None:
        """Checks whether the holder is present, and tells the agent about a change."""
        watch = drone.holder_watch
        if not watch.kept(drone.holder_id, now):
            watch.kept_by = None
        was_missing = watch.missing_since is not None
        deaf = now < drone.holder_deaf_until
        if drone.holder_id is None or (drone.holder_is_there(now) and not deaf):
            watch.present()
        else:
            watch.missing(by_hand=drone.flown_by_hand(now), now=now)
        if was_missing != (watch.missing_since is not None):
            self._state.send_holder_to_agent(drone)

    def keep(self, drone: LiveDrone, user_id: UserId, now: float) -> None:
        """A program of the holder sends a keep-alive."""
        drone.holder_watch.keep(user_id, now)
        self.note_presence(drone, now)

    def note_presence_of(self, user_id: UserId, now: float) -> None:
        """A browser of this user connected or left: notifies the agents of held drones at once."""
        for drone in self._state.drones.values():
            if drone.holder_id == user_id:
                self.note_presence(drone, now)

    def _watch_link(self, drone: LiveDrone, now: float) -> None:
        if drone.link is None:
            return
        if drone.holder_id is not None or drone.lease.assistant is not None:
            drone.close_until = now + CLOSE_FOR_S
        drone.link.sealed.keepalive.watch_closely(now <= drone.close_until, now)
        drone.link.send_keepalives(now)
        if drone.online and not drone.link.is_heard(now):
            drone.online = False
            drone.silent(self._state.clock())
            self._state.publish_soon(drone)

    def _watch_holder(self, drone: LiveDrone, now: float) -> None:
        holder_id = drone.holder_id
        watch = drone.holder_watch
        if holder_id is None or watch.missing_since is None:
            return
        if watch.gone(now):
            self._state.on_event(HolderGone(drone.drone_id, holder_id, now - watch.missing_since))
        if watch.expired(now):
            self._state.on_event(HolderExpired(drone.drone_id, holder_id))

    def _watch_round_trip(self, drone: LiveDrone, now: float) -> None:
        browser = drone.watchers.get(drone.sticks_from)
        if browser is None or drone.link is None or not drone.flown_by_hand(now):
            drone.rtt_watch.check(0.0, limit=1.0, for_s=0.0, now=now)
            return
        keepalive = drone.link.sealed.keepalive
        rtt_ms = 1000.0 * (browser.trip.rtt_s(now) + keepalive.rtt_now_s(now))
        if drone.rtt_watch.check(rtt_ms, limit=drone.safety.rtt_limit_ms, for_s=drone.safety.rtt_limit_s, now=now):
            self._state.on_event(RttTooLong(drone.drone_id, rtt_ms))

    def _watch_loan(self, drone: LiveDrone, now: float) -> None:
        place = whole_place_in(drone.position_frame) if drone.position_frame is not None else None
        if place is None:
            return
        if drone.armed is False and not drone.has_reported_home:
            drone.home = Home(place.lat_deg, place.lon_deg, place.alt_amsl_m)
        loan = next((one for one in drone.record.loans if one.user.id == drone.holder_id), None)
        if loan is None or drone.airborne is False or not drone.flown_by_hand(now):
            return
        pilot = drone.watchers.get(drone.sticks_from)
        limits = drone.limits_of(loan.user.id, pilot.viewer.role) if pilot is not None else None
        why = drone.limit_watch.must_hold(limits, place, drone.home) if limits is not None else None
        if why is not None:
            self._state.on_event(LoanLimitPassed(drone.drone_id, loan.user.id, why))
            pilot_notice = live.Notice("error", "loan", f"{drone.record.name} holds: {why}.", drone.drone_id, 1)
            self._state.notify_watchers(drone, pilot_notice)

    def _watch_turn_and_offer(self, drone: LiveDrone, now: float) -> None:
        if drone.lease.assistant is not None and drone.turn.over(now):
            self._state.on_event(TurnRequested(drone.drone_id, "holder"))
        if not drone.lease.offered:
            drone.offered_since = None
        elif drone.offered_since is None:
            drone.offered_since = now
        elif now - drone.offered_since >= OFFER_LAPSES_AFTER_S:
            drone.offered_since = now
            self._state.on_event(OfferLapsed(drone.drone_id))
