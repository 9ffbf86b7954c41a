"""Why an operation is not begun. Knows nothing of HTTP: `server/http/problems.py` maps it."""

from server.kernel.refusal import Refusal


class DroneOffline(Refusal):
    def __init__(self, name: str) -> None:
        super().__init__(f"{name} is offline: nothing was sent to it, and nothing will be sent later")


class AgentTooOld(Refusal):
    def __init__(self, name: str) -> None:
        super().__init__(f"the agent of {name} is too old for this: update it on the drone")


class DroneBusy(Refusal):
    """One thing of a kind at a time."""


class TooManyOperations(Refusal):
    """Of one user, over all drones."""

    def __init__(self) -> None:
        super().__init__("too many requests in a short time: wait a few seconds")


class UnknownOperation(Refusal):
    """Never was, long over, or at a drone that this user may not see."""

    def __init__(self) -> None:
        super().__init__("there is no such operation: it may have ended long ago")


class NotInControl(Refusal):
    """Another user has the controls, nobody has, or they are changing hands."""

    def __init__(self, name: str) -> None:
        super().__init__(f"you do not have the controls of {name}: nothing was sent to it")


class OnlyWatches(Refusal):
    """An observer of the drone's team."""

    def __init__(self, name: str) -> None:
        super().__init__(f"you may watch {name}, but not read from it or see its records")


class Assisted(Refusal):
    def __init__(self, name: str) -> None:
        super().__init__(f"an admin is assisting {name}: wait until they have finished")


class TurnTimeout(Refusal):
    """The assistant's own."""

    def __init__(self, name: str) -> None:
        super().__init__(f"the turn at {name} could not be given to you in time: try again")


class LossCheckOpen(Refusal):
    def __init__(self, name: str) -> None:
        super().__init__(f"read and acknowledge what a loss would do to {name} before arming it")


class NotThroughTheTower(Refusal):
    def __init__(self, name: str) -> None:
        super().__init__(f"this may not be sent to {name} through the tower")


class WouldFall(Refusal):
    def __init__(self, name: str, *, known: bool) -> None:
        where = "is in the air and would fall" if known else "may be in the air and would fall"
        super().__init__(f"{name} {where}: send `force` if you really want that")


class MovesHome(Refusal):
    def __init__(self, name: str, *, known: bool) -> None:
        where = "is in the air" if known else "may be in the air"
        super().__init__(
            f"{name} {where}: where it returns to would move, and what is above home with it; "
            "say `while_flying` if that is what you want"
        )


class ViewTaken(Refusal):
    def __init__(self, name: str) -> None:
        super().__init__(f"an admin has taken the view of {name} with its controls")


class ZoneForbids(Refusal):
    """`item`: the one of the plan, from 0, whose way leads into a zone."""

    def __init__(self, name: str, words: str, *, item: int | None = None) -> None:
        which = f"the way of {name} " if item is None else f"item {item + 1}: the way of {name} there "
        super().__init__(f"{which}{words}")
        self.item = item


class OutsideOwnFence(Refusal):
    """The fence that the autopilot keeps by itself."""

    def __init__(self, name: str, words: str) -> None:
        super().__init__(f"the autopilot of {name} has a fence, and this is outside it: {words}. Nothing was sent")


class LoanForbids(Refusal):
    """`item`: the one of the plan, from 0, that leads beyond what is lent."""

    def __init__(self, name: str, words: str, *, item: int | None = None) -> None:
        which = "" if item is None else f"item {item + 1}: "
        super().__init__(f"{which}{name} is lent to you {words}")
        self.item = item
