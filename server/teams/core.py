"""Why nothing came of a change of a team. Knows nothing of HTTP: `server/http/problems.py` maps it."""

from server.kernel.refusal import Refusal


class UnknownTeam(Refusal):
    """No such team, or none of theirs."""

    def __init__(self) -> None:
        super().__init__("there is no such team")


class UnknownInvitation(Refusal):
    """Unknown, withdrawn, expired, or for another user."""

    def __init__(self) -> None:
        super().__init__("there is no such invitation: it may be over")


class TeamAdminsOnly(Refusal):
    def __init__(self) -> None:
        super().__init__("only an admin of this team may do this")


class NotYourDrone(Refusal):
    def __init__(self, name: str) -> None:
        super().__init__(f"you do not own {name}: only an owner puts a drone into a team")


class InAnotherTeam(Refusal):
    def __init__(self, name: str) -> None:
        super().__init__(f"{name} is in another team: take it out of that one first")


class DroneInUse(Refusal):
    """Whoever flies it now must neither lose it in the air nor be shown to the team."""

    def __init__(self, name: str) -> None:
        super().__init__(f"somebody outside the team has or shares the controls of {name}: wait until they are free")


class LastTeamAdmin(Refusal):
    def __init__(self) -> None:
        super().__init__("a team needs an admin: make somebody else its admin first, or delete the team")


class MemberAlready(Refusal):
    def __init__(self) -> None:
        super().__init__("this user is in the team already: change the role instead")


class TooManyTeams(Refusal):
    def __init__(self, most: int) -> None:
        super().__init__(f"a user makes at most {most} teams")


class TeamFull(Refusal):
    """Too many of something in one team."""
