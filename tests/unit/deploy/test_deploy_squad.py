"""`make run` resumes where it was interrupted, at any point."""

import json
from pathlib import Path

import pytest
import run_local
import squad
from supervised import StepFailed

EVERYTHING = 7
"""Number of commands in a first run with two drones: the database, a query of the users, three accounts, two drones."""


class Tower:
    """The parts of the `tower` command that a squad needs. Ctrl-C may arrive before or after each command."""

    def __init__(self) -> None:
        self.passwords: dict[str, str] = {}
        self.tokens: dict[str, str] = {}
        self.given = 0
        self.interrupted_before: int | None = None
        self.interrupted_after: int | None = None

    def __call__(self, *command: str | Path, stdin: str = "") -> str:
        number = self.given
        self.given += 1
        if number == self.interrupted_before:
            raise KeyboardInterrupt
        said = self._do([str(word) for word in command[1:]], stdin)
        if number == self.interrupted_after:
            raise KeyboardInterrupt
        return said

    def _do(self, words: list[str], stdin: str) -> str:
        match words:
            case ["migrate"]:
                return ""
            case ["user", "list", "--json"]:
                return json.dumps([{"name": name} for name in self.passwords])
            case ["user", "add", name, *_]:
                self._add(self.passwords, name, stdin)
            case ["drone", "add", name, "--owner", owner, "--token-file", file]:
                assert owner in self.passwords
                self._add(self.tokens, name, f"first of {name}")
                Path(file).write_text(self.tokens[name])
            case ["drone", "enrol", name, "--token-file", file]:
                if name not in self.tokens:
                    raise StepFailed(f"there is no drone {name}")
                self.tokens[name] = f"another of {name}"
                Path(file).write_text(self.tokens[name])
            case _:
                raise AssertionError(words)
        return ""

    def _add(self, table: dict[str, str], name: str, secret: str) -> None:
        if name in table:
            raise StepFailed("another one has this name")
        table[name] = secret


@pytest.fixture
def tower(monkeypatch: pytest.MonkeyPatch) -> Tower:
    tower = Tower()
    for module in (squad, run_local):
        monkeypatch.setattr(module, "run_once", tower)
    monkeypatch.delenv("TOWER_ADMIN_PASSWORD", raising=False)
    return tower


def assert_ready(tower: Tower, made: squad.Squad) -> None:
    assert made.first_passwords == tower.passwords
    assert list(tower.passwords) == ["admin", "alice", "bob"]
    assert made.drones == {"Kestrel": "alice", "Merlin": "bob"}
    assert {name: made.token_file(name).read_text() for name in made.drones} == tower.tokens


def test_a_second_run_makes_nothing_again(tower: Tower, tmp_path: Path) -> None:
    assert_ready(tower, run_local.prepare(tmp_path, 2)[0])
    assert tower.given == EVERYTHING
    assert_ready(tower, run_local.prepare(tmp_path, 2)[0])
    assert tower.given == EVERYTHING + 1, "the database is brought up to date, and nothing else"


@pytest.mark.parametrize("number", range(EVERYTHING))
@pytest.mark.parametrize("when", ["before", "after"])
def test_an_interrupted_run_is_taken_up(tower: Tower, tmp_path: Path, number: int, when: str) -> None:
    setattr(tower, f"interrupted_{when}", number)
    with pytest.raises(KeyboardInterrupt):
        run_local.prepare(tmp_path, 2)
    assert_ready(tower, run_local.prepare(tmp_path, 2)[0])


def test_an_account_that_it_did_not_make_is_left_alone(tower: Tower, tmp_path: Path) -> None:
    tower.passwords["admin"] = "of somebody else"
    for _ in range(2):
        with pytest.raises(StepFailed, match="TOWER_VAR"):
            run_local.prepare(tmp_path, 2)
    assert tower.passwords == {"admin": "of somebody else"}


def test_a_first_password_is_forgotten_when_it_was_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(squad, "run_once", Tower())
    made = squad.Squad(tmp_path)
    made.add_users({name: ("operator", f"first of {name}", False) for name in ("anna", "ben", "carla")})
    made.forget_changed_passwords({"anna": {"first_password": False}, "ben": {"first_password": True}})
    text = (tmp_path / "squad.json").read_text()
    assert [name in text for name in ("first of anna", "first of ben", "first of carla")] == [False, True, False]

    again = squad.Squad(tmp_path)
    assert again.accounts == ["anna", "ben", "carla"]
    assert again.first_passwords == {"ben": "first of ben"}
    again.add_users({"anna": ("operator", "another", False)})
    assert "another" not in (tmp_path / "squad.json").read_text(), "nobody is made twice"


def test_a_file_of_before_says_who_was_made(tmp_path: Path) -> None:
    known = {"first_passwords": {"anna": "first of anna"}, "drones": {}}
    (tmp_path / "squad.json").write_text(json.dumps(known))
    assert squad.Squad(tmp_path).accounts == ["anna"]
