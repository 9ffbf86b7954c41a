"""Why an agent is not updated. Knows nothing of HTTP: `server/http/problems.py` maps it."""

from server.kernel.refusal import Refusal


class UnknownRelease(Refusal):
    def __init__(self, version: str) -> None:
        super().__init__(
            f"the tower has no release {version} of the agent: put its package into the folder of releases"
        )


class FlownByAnother(Refusal):
    def __init__(self, name: str, holder: str) -> None:
        super().__init__(f"{holder} has the controls of {name}: its agent is updated when nobody else has them")
