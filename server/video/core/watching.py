"""Who may watch the video of a drone: all who may have its frames and were not barred from the video.

Uses the one judgement of `server.http.access`, at the start and again on each change.
"""

from typing import Final, NamedTuple

from server.kernel.access import AccessRequest, Action, UnknownDrone, judge
from server.kernel.people import Principal
from server.live.live_drone import LiveDrone

NOT_FOR_WATCHING: Final = 4403
NO_SUCH_DRONE: Final = 4404
VIEW_TAKEN: Final = 4403


class NotToWatch(NamedTuple):
    """Why not. `code`: with which a connection is closed."""

    code: int
    words: str


def why_not_watch(drone: LiveDrone | None, principal: Principal) -> NotToWatch | None:
    """None: they may. A drone that is not there and one that is not theirs get the same answer."""
    relation = None if drone is None else drone.relation_of(principal.user_id, principal.role)
    refusal = judge(AccessRequest(principal, Action.SEE_DRONE, relation)).refusal
    if refusal is not None:
        code = NO_SUCH_DRONE if isinstance(refusal, UnknownDrone) else NOT_FOR_WATCHING
        return NotToWatch(code, refusal.message)
    if drone is not None and drone.no_video_user_id == principal.user_id:
        return video_taken(drone.record.name)
    return None


def video_taken(name: str) -> NotToWatch:
    """An admin has taken the video with the controls."""
    return NotToWatch(VIEW_TAKEN, f"an admin has taken the video of {name} with the controls")
