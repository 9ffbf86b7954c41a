"""Why a preflight checklist is not signed or changed."""

from server.kernel.refusal import Refusal


class PreflightIncomplete(Refusal):
    """Own lines that the request does not confirm."""

    def __init__(self, name: str, missing: int) -> None:
        items = "1 item" if missing == 1 else f"{missing} items"
        super().__init__(f"confirm every item of the checklist of {name} first: {items} left")


class SignsForPilot(Refusal):
    def __init__(self, name: str) -> None:
        super().__init__(f"whoever has the controls of {name}, or assists, signs its checklist")


class NotYourChecklist(Refusal):
    def __init__(self) -> None:
        super().__init__("owners and admins change the checklist of a drone, admins that of a kind")


class NoSuchKind(Refusal):
    def __init__(self) -> None:
        super().__init__("there is no such kind of drone")
