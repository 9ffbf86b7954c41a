"""The accounts, drones and secrets that `make run` keeps in a data folder between runs.

Each object is recorded before it is created, and again afterwards. So the next run continues an interrupted one
(Ctrl-C, a closed terminal, a kill): the object that was about to be created either exists or does not exist yet.
"""

import json
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from supervised import StepFailed, run_once

BIN: Final = Path(sys.executable).parent


def accounts_now() -> dict[str, dict[str, Any]]:
    """Returns the accounts in the database, by name."""
    return {one["name"]: one for one in json.loads(run_once(BIN / "tower", "user", "list", "--json"))}


class Squad:
    """The accounts and drones of one data folder. Reads `squad.json` there, and keeps it current."""

    def __init__(self, var: Path) -> None:
        self._file = var / "squad.json"
        self.tokens = var / "tokens"
        self.accounts: list[str] = []
        """Those created here."""
        self.first_passwords: dict[str, str] = {}
        """Of users who have not chosen a new one yet."""
        self.drones: dict[str, str] = {}
        """Drone name to its operator."""
        self._begun: dict[str, str] = {}
        """The object being created: a `user` with a `password`, or a `drone`."""
        if self._file.exists():
            known = json.loads(self._file.read_text())
            self.first_passwords, self.drones = known["first_passwords"], known["drones"]
            self.accounts = known.get("accounts", list(self.first_passwords))
            self._begun = known.get("begun", {})

    def token_file(self, drone: str) -> Path:
        """Returns the file of the drone's key; before its agent's first start, the file has its enrolment token."""
        return self.tokens / f"{drone.lower().replace(' ', '-')}.token"

    def add_users(self, wanted: Mapping[str, tuple[str, str, bool]]) -> None:
        """Adds missing accounts: name to role, password, and whether somebody chose the password.

        A chosen password need not be changed at the first sign-in. Raises StepFailed if an account of such a name
        exists that was not created here: no existing password is changed.
        """
        missing = {name: new for name, new in wanted.items() if name not in self.accounts}
        accounts = accounts_now() if missing else {}
        for name, (role, password, chosen) in missing.items():
            if name not in accounts:
                self._begin(user=name, password=password)
                first = "--for-good" if chosen else "--must-change"
                run_once(BIN / "tower", "user", "add", name, "--role", role, first, "--password-stdin", stdin=password)
            elif self._begun.get("user") == name:
                password = self._begun["password"]
            else:
                raise StepFailed(
                    f"The database has a user {name} already, whom this did not make. "
                    f"Choose another folder than {self._file.parent}: TOWER_VAR=FOLDER make run"
                )
            self.accounts.append(name)
            self.first_passwords[name] = password
            self._done()

    def forget_changed_passwords(self, accounts: Mapping[str, Mapping[str, Any]]) -> None:
        """Forgets changed first passwords: they are void, but still show how somebody chooses passwords.

        `accounts`: from `accounts_now`.
        """
        changed = [
            name for name in self.first_passwords if name not in accounts or not accounts[name]["first_password"]
        ]
        if changed:
            self.first_passwords = {
                name: password for name, password in self.first_passwords.items() if name not in changed
            }
            self._save()

    def add_drone(self, name: str, operator: str) -> None:
        """Adds a drone unless it exists."""
        if name in self.drones:
            if self._is_not_enrolled(name):  # a token expires earlier than a folder
                self._has_new_token(name)
            return
        self.tokens.mkdir(mode=0o700, exist_ok=True)
        if self._begun.get("drone") != name or not self._has_new_token(name):
            self._begin(drone=name)
            run_once(BIN / "tower", "drone", "add", name, "--owner", operator, "--token-file", self.token_file(name))
        self.drones[name] = operator
        self._done()

    def _is_not_enrolled(self, drone: str) -> bool:
        file = self.token_file(drone)
        return file.exists() and file.read_text().startswith("twe_")

    def _has_new_token(self, drone: str) -> bool:
        """Writes a new token, because the file may have an earlier one; returns whether the drone exists."""
        try:
            run_once(BIN / "tower", "drone", "enrol", drone, "--token-file", self.token_file(drone))
        except StepFailed:
            return False
        return True

    def _begin(self, **what: str) -> None:
        self._begun = what
        self._save()

    def _done(self) -> None:
        self._begun = {}
        self._save()

    def _save(self) -> None:
        known = {
            "accounts": self.accounts,
            "first_passwords": self.first_passwords,
            "drones": self.drones,
            "begun": self._begun,
        }
        draft = self._file.with_suffix(".new")
        descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(descriptor, "w") as out:
            json.dump(known, out, indent=2)
        draft.replace(self._file)
