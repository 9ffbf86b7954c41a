"""The rules of the lease table, one function for each kind of cell. Pure: `lease.py` assigns them to cells."""

from dataclasses import replace

from server.control.core.lease_types import Actor, Changed, Lease, Order, Outcome, Refused
from wire.ids import Epoch

_NO_PILOT = Refused("not-an-owner", "only its owners and the pilots of its team can have the controls of this drone")
_ADMINS_ONLY_TAKE = Refused("admins-only", "only an admin can take control from somebody")
_ALREADY_YOURS = Refused("already-yours", "you already have the controls")
_HOLDS_ANOTHER = Refused("holds-another", "release the drone that you are flying first")
_OUTRANKED = Refused("held-by-admin", "an admin of the tower has the controls or assists: a team admin must wait")
_TOO_LATE = Refused("moved-on", "the controls have changed hands in the meantime")
_TOWER_ONLY = Refused("tower-only", "the tower itself decides this")


# -- refusals that fill whole cells --------------------------------------------------------------------------


def nobody_holds(lease: Lease, actor: Actor) -> Outcome:
    return Refused("not-the-holder", "nobody has the controls")


def nothing_to_give(lease: Lease, actor: Actor) -> Outcome:
    if not actor.may_take:
        return Refused("admins-only", "only an admin who took control can give it back")
    return Refused("nothing-to-give", "the controls were not taken from anybody")


def nothing_offered(lease: Lease, actor: Actor) -> Outcome:
    return Refused("nothing-offered", "nobody has offered you these controls")


def already_offered(lease: Lease, actor: Actor) -> Outcome:
    if lease.holder != actor.user_id:
        return Refused("not-the-holder", "only the admin who took control can give it back")
    return Refused("already-offered", "the controls are offered already; wait until they are accepted")


def nobody_to_assist(lease: Lease, actor: Actor) -> Outcome:
    if not actor.may_take:
        return Refused("admins-only", "only an admin can assist")
    return Refused("nobody-to-assist", "nobody has the controls, so there is nobody to assist")


def admin_holds(lease: Lease, actor: Actor) -> Outcome:
    if not actor.may_take:
        return Refused("admins-only", "only an admin can assist")
    return Refused("cannot-assist", "an admin has taken control; only their usual holder can be assisted")


def nobody_assists(lease: Lease, actor: Actor) -> Outcome:
    return Refused("nobody-assists", "nobody assists")


def nothing_taken(lease: Lease, actor: Actor) -> Outcome:
    return Refused("nothing-taken", "the controls were not taken from anybody")


# -- acquire, release ----------------------------------------------------------------------------------------


def acquire_free(lease: Lease, actor: Actor) -> Outcome:
    if not (actor.is_owner or actor.is_admin):
        return _NO_PILOT
    if actor.holds_another:
        return _HOLDS_ANOTHER
    return Changed(lease.next(holder=actor.user_id))


def acquire_held(lease: Lease, actor: Actor) -> Outcome:
    if lease.holder == actor.user_id:
        return _ALREADY_YOURS
    return Refused("held-by-other", "somebody else has the controls")


def acquire_taken(lease: Lease, actor: Actor) -> Outcome:
    if lease.taken_from == actor.user_id:
        return Refused("taken-away", "an admin has taken control; wait until it is given back")
    return acquire_held(lease, actor)


def acquire_offered(lease: Lease, actor: Actor) -> Outcome:
    if lease.taken_from == actor.user_id:
        return Refused("offered", "the controls are offered to you: accept them")
    return acquire_held(lease, actor)


def release(lease: Lease, actor: Actor) -> Outcome:
    if lease.holder != actor.user_id:
        return Refused("not-the-holder", "only the holder can release the controls")
    return Changed(lease.next(holder=None), (Order.HOLD_IF_FLOWN_BY_HAND,))


# -- take, give, accept --------------------------------------------------------------------------------------


def _why_not_take(actor: Actor) -> Refused | None:
    """A team admin yields to admins of the tower, and holds at most one drone, like an operator."""
    if not actor.may_take:
        return _ADMINS_ONLY_TAKE
    if actor.is_admin:
        return None
    return _OUTRANKED if actor.outranked else _HOLDS_ANOTHER if actor.holds_another else None


def take_free(lease: Lease, actor: Actor) -> Outcome:
    refused = _why_not_take(actor)
    if refused is not None:
        return refused
    # The drone has no holder, so nobody is shut out; but it may be in the air, so it holds first.
    return Changed(lease.next(holder=actor.user_id), (Order.HOLD,))


def take_held(lease: Lease, actor: Actor) -> Outcome:
    if actor.may_take and lease.holder == actor.user_id:
        return _ALREADY_YOURS
    refused = _why_not_take(actor)
    if refused is not None:
        return refused
    taken = lease.next(
        holder=actor.user_id, taken_from=lease.holder, view_taken=not actor.watch, video_moved=actor.moves_video
    )
    return Changed(taken, (Order.HOLD,))


def take_taken(lease: Lease, actor: Actor) -> Outcome:
    if actor.may_take and lease.holder == actor.user_id:
        return _ALREADY_YOURS
    refused = _why_not_take(actor)
    if refused is not None:
        return refused
    # From one admin to another it is still owed to the operator it was first taken from, unless that operator has
    # become an admin and takes it now.
    if lease.taken_from == actor.user_id:
        return Changed(lease.next(holder=actor.user_id), (Order.HOLD,))
    taken = lease.next(
        holder=actor.user_id, taken_from=lease.taken_from, view_taken=not actor.watch, video_moved=actor.moves_video
    )
    return Changed(taken, (Order.HOLD,))


def take_offered(lease: Lease, actor: Actor) -> Outcome:
    if actor.may_take and lease.holder == actor.user_id:
        # The offer is withdrawn. The drone has been holding since it was made, and its holder has not changed.
        return Changed(_still_taken(lease))
    return take_taken(lease, actor)


def _still_taken(lease: Lease, *, offered: bool = False) -> Lease:
    return lease.next(
        holder=lease.holder,
        taken_from=lease.taken_from,
        offered=offered,
        view_taken=lease.view_taken,
        video_moved=lease.video_moved,
    )


def give(lease: Lease, actor: Actor) -> Outcome:
    if lease.holder != actor.user_id or not actor.may_take:
        return Refused("not-the-holder", "only the admin who took control can give it back")
    if not actor.operator_may_fly:
        return Refused("cannot-receive", "the operator cannot fly this drone now; release the controls instead")
    return Changed(_still_taken(lease, offered=True), (Order.HOLD,))


def accept(lease: Lease, actor: Actor) -> Outcome:
    if lease.taken_from != actor.user_id:
        return Refused("not-offered-to-you", "the controls are offered to somebody else")
    if actor.holds_another:
        return _HOLDS_ANOTHER
    if not actor.operator_may_fly:
        return _NO_PILOT
    if not actor.sticks_centred:
        return Refused("sticks-not-centred", "centre your sticks, then say that you have control")
    return Changed(lease.next(holder=lease.taken_from), (Order.HOLD,))


def offer_lapsed(lease: Lease, actor: Actor) -> Outcome:
    if not actor.is_tower:
        return _TOWER_ONLY
    return Changed(_still_taken(lease))


# -- assist --------------------------------------------------------------------------------------------------


def assist(lease: Lease, actor: Actor) -> Outcome:
    if not actor.may_take:
        return Refused("admins-only", "only an admin can assist")
    if lease.holder == actor.user_id:
        return _ALREADY_YOURS
    if lease.assistant == actor.user_id:
        return Refused("already-assisting", "you assist already")
    if actor.outranked:
        return _OUTRANKED
    if lease.assistant is not None:
        return Refused("assisted-by-other", "another admin assists already")
    return Changed(lease.next(holder=lease.holder, assistant=actor.user_id))


def assist_end(lease: Lease, actor: Actor) -> Outcome:
    if lease.assistant is None:
        return nobody_assists(lease, actor)
    if actor.is_tower:
        if actor.about not in (None, lease.assistant):
            return _TOO_LATE
    elif lease.assistant != actor.user_id:
        if not actor.may_take:
            return Refused("admins-only", "only an admin can end the assistance")
        if actor.outranked:
            return _OUTRANKED
    return Changed(lease.next(holder=lease.holder))


def turn(lease: Lease, actor: Actor) -> Outcome:
    if not actor.is_tower:
        return _TOWER_ONLY
    if lease.assistant is None:
        return nobody_assists(lease, actor)
    # Changes only the epoch: sticks of two people never pass in the same epoch.
    return Changed(replace(lease, epoch=Epoch(lease.epoch + 1)))


# -- lost rights and lost presence ---------------------------------------------------------------------------


def revoke(lease: Lease, actor: Actor) -> Outcome:
    if not (actor.is_tower or actor.is_admin):
        return Refused("admins-only", "only an admin can revoke the controls")
    if actor.about not in (None, lease.holder):
        return _TOO_LATE
    return Changed(lease.next(holder=None), (Order.HOLD,))


def forget(lease: Lease, actor: Actor) -> Outcome:
    if not (actor.is_tower or actor.is_admin):
        return Refused("admins-only", "only an admin can decide this")
    if actor.about not in (None, lease.taken_from):
        return _TOO_LATE
    return Changed(lease.next(holder=lease.holder))


def expire(lease: Lease, actor: Actor) -> Outcome:
    if not actor.is_tower:
        return _TOWER_ONLY
    if actor.about not in (None, lease.holder):
        return _TOO_LATE
    # A drone flown by hand was told to hold long ago. By now the autopilot may be returning home or flying a mission: a
    # hold would only interrupt that, with nobody there to end it.
    return Changed(lease.next(holder=None), (Order.HOLD_IF_FLOWN_BY_HAND,))
