"""Applies database snapshots of drones, owners and accounts to the live state. The newest one wins."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from datetime import datetime
from typing import Final, Literal

from server.kernel.access import Action, reaches_all
from server.kernel.fleet import DroneRecord, FleetSnapshot, SignInRecord, UserRecord
from server.kernel.people import Principal, Role, SignInId, TokenId, UserRef
from server.kernel.relations import Right
from server.link.core.restraint import QUARANTINED_WORDS
from server.live import live_messages as live
from server.live.browser import Browser
from server.live.hub_events import NOT_OF_ITS_TEAM, ControlsMoved, RightLost
from server.live.live_drone import LeaseView, LiveDrone, lease_of
from server.live.live_state import LiveState
from wire.ids import DroneId, UserId

IDENTITY_GONE = 4401
SESSION_ENDED = 4401
ACCOUNT_DELETED: Final = "the account was deleted"
ACCOUNT_DISABLED: Final = "the account was disabled"

MAX_ENDED: Final = 10_000
"""Sign-ins that ended and are remembered as such: a snapshot read before may still know them."""

Part = Literal["holder", "taken_from", "assistant"]


class FleetChanges:
    """Takes snapshots over. One older than the last is ignored. `lease_learnt`: called with a drone whose lease a
    snapshot has changed, the lease before, and why its holder may hold it no more (empty: they may)."""

    def __init__(self, state: LiveState, *, lease_learnt: Callable[[LiveDrone, LeaseView, str], None]) -> None:
        self._state = state
        self._lease_learnt = lease_learnt
        self._revision = -1
        self._users: Mapping[UserId, UserRecord] = {}
        self._ended: dict[SignInId, None] = {}
        self._sign_ins: Mapping[SignInId, SignInRecord] = {}
        self._newer: dict[SignInId, SignInRecord] = {}
        """Sessions that began after the last snapshot, as the database knows them."""
        self.newest_session = 0
        """The greatest number of one that is known."""

    @property
    def revision(self) -> int:
        """Of the last snapshot; -1 before the first."""
        return self._revision

    def knows_sign_in(self, sign_in: SignInId) -> bool:
        """Whether the last snapshot has this session or token. It lacks a session that began after it was read."""
        return sign_in in self._sign_ins or sign_in in self._newer

    def note_sign_ins(self, found: Mapping[SignInId, SignInRecord]) -> None:
        """Sessions that are newer than the last snapshot, read from the database."""
        new = {one: record for one, record in found.items() if one not in self._ended and one not in self._sign_ins}
        self._newer |= new
        self.newest_session = max([self.newest_session, *(one for one in new if isinstance(one, int))])
        while len(self._newer) > MAX_ENDED:
            del self._newer[next(iter(self._newer))]

    def principal_of(self, sign_in: SignInId, user_id: UserId, expires_at: datetime) -> Principal | None:
        """Who is signed in by this session or token, with name, role and scopes as this tower knows them. None: it is
        not this user's, has ended, or is not known here."""
        account = self._users.get(user_id)
        record = self._sign_ins.get(sign_in) or self._newer.get(sign_in)
        if account is None or account.disabled or account.must_change_password or sign_in in self._ended:
            return None
        if record is None or record.user_id != user_id:
            return None
        return Principal(user_id, account.name, account.role, sign_in, expires_at, scopes=record.scopes)

    def is_current(self, principal: Principal, revision: int) -> bool:
        """Whether a sign-in that the database confirmed while the fleet was at `revision` is still good, as far as is
        known here."""
        account = self._users.get(principal.user_id)
        if account is None or account.disabled or account.role is not principal.role:
            return False
        if principal.session_id in self._ended:
            return False
        return revision == self._revision or self.knows_sign_in(principal.session_id)

    def note_ended(self, ended: Iterable[SignInId]) -> None:
        """These sessions have ended, even if an older snapshot still contains them."""
        self._ended.update(dict.fromkeys(ended))
        while len(self._ended) > MAX_ENDED:
            del self._ended[next(iter(self._ended))]
        for one in self._ended.keys() & self._newer.keys():
            del self._newer[one]

    def apply(self, snapshot: FleetSnapshot) -> None:
        """Drones, owners, accounts and leases as the database knows them."""
        if snapshot.revision < self._revision:
            return
        self._revision = snapshot.revision
        self._users = snapshot.users
        self._state.shares.apply(snapshot.share_limits)
        self._sign_ins = snapshot.sign_ins
        newest = self.newest_session = max((one for one in snapshot.sign_ins if isinstance(one, int)), default=0)
        self._newer = {one: record for one, record in self._newer.items() if isinstance(one, int) and one > newest}
        state = self._state
        records = {record.id: record for record in snapshot.drones}
        for drone_id in [known for known in state.drones if known not in records]:
            self._remove(drone_id)
        for record in records.values():
            self._put(record)
        for browser in list(state.browsers.values()):
            why = why_signed_out(browser.viewer, snapshot)
            if why:
                self.close_browser(browser, why)
        for drone in state.drones.values():
            self._report_lost_rights(drone)

    def name_of(self, user_id: UserId) -> str:
        """Empty: there is no such account."""
        account = self._users.get(user_id)
        return "" if account is None else account.name

    def outranks(self, user_id: UserId) -> bool:
        """Whether this account takes control of any drone: a team admin gives way to it."""
        account = self._users.get(user_id)
        return account is not None and reaches_all(account.role, Action.COMMAND)

    def end_loans(self, at: datetime) -> bool:
        """Whose time is over is no borrower any more, from this instant. Whether there was any."""
        over = [
            (drone, loan) for drone in self._state.drones.values() for loan in drone.record.loans if loan.until <= at
        ]
        for drone, loan in over:
            left = tuple(one for one in drone.record.loans if one is not loan)
            drone.record = replace(drone.record, loans=left)
            account = self._users.get(loan.user.id)
            self.admit_watchers(drone)
            self._state.publish_drone(drone)
            if account is not None and drone.may(loan.user.id, account.role, Right.FLY):
                continue
            parts: tuple[tuple[UserRef | None, Part], ...] = (
                (drone.lease.holder, "holder"),
                (drone.lease.taken_from, "taken_from"),
            )
            for user, whose in parts:
                if user is not None and user.id == loan.user.id:
                    self._state.on_event(RightLost(drone.drone_id, user.id, whose, "the loan is over"))
        return bool(over)

    def _put(self, record: DroneRecord) -> None:
        state = self._state
        drone = state.drones.get(record.id)
        if drone is None:
            drone = state.drones[record.id] = LiveDrone(record, lease_of(record), state.place_of(record.id))
            self.admit_watchers(drone)
            return
        if record == drone.record and record.epoch <= drone.lease.epoch:
            return  # nearly all of them, nearly every time: a change of one drone must not cost a thousand
        before, ties_before = drone.view(), drone.record.ties
        team_changed = record.team != drone.record.team
        if record.identity != drone.record.identity:
            self._end_link(drone, "what this agent signed in by has been revoked or replaced")
        drone.record, drone.crew_before = record, ties_before.crew
        if drone.is_quarantined:
            self._end_link(drone, QUARANTINED_WORDS)
        # The lease in a snapshot may have been read before a change that has been applied meanwhile.
        if record.epoch >= drone.lease.epoch:
            last = drone.lease
            drone.lease = lease_of(record)
            if record.epoch > last.epoch:
                drone.turn.reset()
                self._lease_learnt(drone, last, _why_lost(drone, last.holder, self._users))
                state.send_holder_to_agent(drone)
                state.on_event(ControlsMoved(record.id))
        if team_changed or record.ties != ties_before or drone.view() != before:
            for browser in drone.watchers.values():
                viewer = browser.viewer
                if drone.may(viewer.user_id, viewer.role, Right.SEE):
                    browser.notify(live.DroneChanged(drone.view_for(viewer.user_id, viewer.role)))
        self.admit_watchers(drone)

    def _end_link(self, drone: LiveDrone, why: str) -> None:
        if drone.link is not None:
            drone.link.close(IDENTITY_GONE, why)
            self._state.links.pop(drone.link.link_id, None)
            drone.forget_link(self._state.clock())

    def _remove(self, drone_id: DroneId) -> None:
        drone = self._state.drones.pop(drone_id)
        if drone.link is not None:
            drone.link.close(IDENTITY_GONE, "the drone has been removed")
            self._state.links.pop(drone.link.link_id, None)
        for browser in drone.watchers.values():
            browser.outbox.forget(drone_id)
            browser.notify(live.DroneRemoved(drone_id))

    def admit_watchers(self, drone: LiveDrone) -> None:
        """Browsers that may see the drone now do, the others no longer."""
        for browser in self._state.browsers.values():
            viewer = browser.viewer
            allowed = drone.may(viewer.user_id, viewer.role, Right.SEE)
            shown = allowed and drone.is_shown_to(browser)
            if shown and browser.number not in drone.watchers:
                drone.watchers[browser.number] = browser
                browser.notify(live.DroneChanged(drone.view_for(viewer.user_id, viewer.role)))
            elif not shown and drone.watchers.pop(browser.number, None) is not None:
                browser.outbox.forget(drone.drone_id)
                if not allowed:  # else another tower shows it from here on
                    browser.notify(live.DroneRemoved(drone.drone_id))

    def close_browser(self, browser: Browser, why: str) -> None:
        """Nothing more goes out or comes in from this instant; the socket's own end only tells why."""
        self._state.browsers.pop(browser.number, None)
        for drone in self._state.drones.values():
            drone.watchers.pop(browser.number, None)
        browser.close(SESSION_ENDED, why)

    def check_lease(self, drone_id: DroneId) -> None:
        """The lease has changed. A right may have ended between the decision and now: when it ended, the person had
        another part in the lease or none, so nothing was reported of the part that they have now."""
        drone = self._state.drones.get(drone_id)
        if drone is not None:
            self._report_lost_rights(drone)

    def _report_lost_rights(self, drone: LiveDrone) -> None:
        lease = drone.lease
        self._report_if_lost(drone, lease.holder, "holder", admin_only=lease.taken_from is not None)
        self._report_if_lost(drone, lease.taken_from, "taken_from", admin_only=False)
        self._report_if_lost(drone, lease.assistant, "assistant", admin_only=True)

    def _report_if_lost(self, drone: LiveDrone, user: UserRef | None, whose: Part, *, admin_only: bool) -> None:
        why = _why_lost(drone, user, self._users, admin_only=admin_only)
        if user is not None and why:
            self._state.on_event(RightLost(drone.drone_id, user.id, whose, why))


def _why_lost(
    drone: LiveDrone, user: UserRef | None, users: Mapping[UserId, UserRecord], *, admin_only: bool = False
) -> str:
    """Why this user may have no part in the lease any more, in words; empty where they may. `admin_only`: only an admin
    of the tower, or of its team, may have this part."""
    if user is None:
        return ""
    account = users.get(user.id)
    if account is None:
        return ACCOUNT_DELETED
    if account.disabled:
        return ACCOUNT_DISABLED
    if drone.may(user.id, account.role, Right.TAKE if admin_only else Right.FLY):
        return ""
    if admin_only:
        return "no longer an admin"
    return NOT_OF_ITS_TEAM if user.id in drone.crew_before else "no longer an owner of this drone"


def role_changed(role: Role) -> str:
    """For people signed in with the account's former role."""
    return f"the account is now that of an {role.value}"


def why_signed_out(principal: Principal, snapshot: FleetSnapshot) -> str:
    """For people whose connection ends; empty if they may stay."""
    account = snapshot.users.get(principal.user_id)
    if account is None:
        return ACCOUNT_DELETED
    if account.disabled:
        return ACCOUNT_DISABLED
    if account.role != principal.role:
        return role_changed(account.role)
    if account.must_change_password:
        return "an admin has set a new password"
    signed_in_by = principal.session_id
    revoked = isinstance(signed_in_by, TokenId) and signed_in_by not in snapshot.sign_ins
    return "the token was revoked" if revoked else ""
