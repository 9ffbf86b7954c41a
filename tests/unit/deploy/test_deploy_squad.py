"""`make run` is taken up where it was interrupted, wherever that was."""

import json
from pathlib import Path

import pytest
import run_local
import squad
from supervised import StepFailed

EVERYTHING = 7
"""Commands that a first run with two drones gives: the database, a look at who is there, three accounts, two drones."""


class Tower:
    """The `tower` command, as far as it concerns a squad. Somebody may press Ctrl-C before or after what it does."""

    def __init__(self) -> None:
        self.passwords: dict[str, str] = {}
        self.credentials: dict[str, str] = {}
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
                self._add(self.credentials, name, f"first of {name}")
                Path(file).write_text(self.credentials[name])
            case ["drone", "credential", name, "--token-file", file]:
                if name not in self.credentials:
                    raise StepFailed(f"there is no drone {name}")
                self.credentials[name] = f"another of {name}"
                Path(file).write_text(self.credentials[name])
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
    assert {name: made.token_file(name).read_text() for name in made.drones} == tower.credentials


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
