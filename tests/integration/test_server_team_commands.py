"""`tower team ...`, as the tower's operator uses it. The commands run in this process."""

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from server.app.cli import app
from server.app.commands.session import CommandError
from server.kernel.refusal import Refusal

Tower = Callable[..., str]


@pytest.fixture
def tower(tmp_path: Path) -> Tower:
    environment = {"TOWER_VAR": str(tmp_path / "var"), "TOWER_ARGON2_MEMORY_KIB": "19456", "TOWER_ARGON2_ROUNDS": "2"}

    def run(*words: str) -> str:
        """Returns standard output. Raises the error that `main` would print to standard error."""
        done = CliRunner().invoke(app, words, env=environment)
        if done.exception is not None:
            raise done.exception
        return done.output

    run("migrate")
    return run


def test_a_team_by_command(tower: Tower, tmp_path: Path) -> None:
    for name in ("anna", "ben"):
        tower("user", "add", name)
    tower("drone", "add", "hawk", "--owner", "anna", "--token-file", str(tmp_path / "hawk.token"))
    assert tower("team", "add", "rescue", "--admin", "anna").startswith("added team rescue (id ")
    assert tower("team", "member", "rescue", "ben", "observer") == "ben is observer in rescue\n"
    assert tower("team", "member", "rescue", "ben", "operator") == "ben is operator in rescue\n"
    assert tower("team", "drone", "rescue", "hawk") == "hawk is in rescue\n"
    heading, row = tower("team", "list").splitlines()
    assert heading.split() == ["ID", "NAME", "PEOPLE", "DRONES"]
    number, rest = row.split(maxsplit=1)
    assert rest.split("  ") == ["rescue", "anna (admin), ben (operator)", "hawk"]
    # By its id if the name is not unique.
    tower("team", "add", "rescue")
    with pytest.raises(CommandError, match="rescue is more than one team: say its id"):
        tower("team", "drone", "rescue", "hawk", "--remove")
    assert tower("team", "drone", number, "hawk", "--remove") == "hawk is not in rescue\n"
    assert tower("team", "member", number, "ben", "--remove") == "ben is not in rescue\n"
    for words, wrong in (
        (("team", "member", number, "ben"), "say either a role"),
        (("team", "member", number, "carla", "operator"), "there is no user named carla"),
        (("team", "member", number, "carla", "--remove"), "there is no user named carla"),
        (("team", "member", number, "ben", "--remove"), "there is no such user"),
        (("team", "drone", "none", "hawk"), "there is no team none"),
        (("team", "drone", number, "owl"), "there is no drone owl"),
    ):
        with pytest.raises((CommandError, Refusal), match=wrong):
            tower(*words)
