"""Why a preflight checklist is not signed or changed."""

from server.kernel.refusal import Refusal


class PreflightIncomplete(Refusal):
    """Own lines that the request does not confirm."""

    def __init__(self, name: str, missing: int) -> None:
        lines = "1 own line" if missing == 1 else f"{missing} own lines"
        super().__init__(f"confirm every own line first: {lines} of {name} left")


class SignsForPilot(Refusal):
    def __init__(self, name: str) -> None:
        super().__init__(f"whoever has the controls of {name}, or assists, signs its checklist")


class NotYourChecklist(Refusal):
    def __init__(self) -> None:
        super().__init__("owners and admins change the lines of a drone, admins those of a kind")


class NoSuchKind(Refusal):
    def __init__(self) -> None:
        super().__init__("there is no such kind of drone")
