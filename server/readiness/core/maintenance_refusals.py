"""Why maintenance is not given out or changed. Knows nothing of HTTP."""

from server.kernel.refusal import Refusal


class UnknownTask(Refusal):
    """Never was, deleted, or of a drone whose flights this user may not read."""

    def __init__(self) -> None:
        super().__init__("there is no such maintenance")


class NotYoursToMaintain(Refusal):
    def __init__(self, name: str) -> None:
        super().__init__(f"the owners of {name} and admins say what maintenance it needs, and that it was done")


class TooManyTasks(Refusal):
    def __init__(self, most: int) -> None:
        super().__init__(f"a drone has at most {most} kinds of maintenance")
