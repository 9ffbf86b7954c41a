"""Who and what `make run` has made in a data folder: accounts, drones, and their secrets, from run to run.

Whatever is made is written down before it is made, and again when it is there. So a run that ends in between (Ctrl-C, a
closed terminal, a kill) is taken up by the next: it finds what it was about to make either there or not there yet.
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
    """What the database says of the accounts, by name."""
    return {one["name"]: one for one in json.loads(run_once(BIN / "tower", "user", "list", "--json"))}


class Squad:
    """The accounts and drones of one data folder. Reads `squad.json` there, and keeps it true."""

    def __init__(self, var: Path) -> None:
        self._file = var / "squad.json"
        self.tokens = var / "tokens"
        self.accounts: list[str] = []
        """Those that were made here."""
        self.first_passwords: dict[str, str] = {}
        """Of those whose user has not chosen another one yet."""
        self.drones: dict[str, str] = {}
        """Drone name to its operator."""
        self._begun: dict[str, str] = {}
        """What is just being made: a `user` with a `password`, or a `drone`."""
        if self._file.exists():
            known = json.loads(self._file.read_text())
            self.first_passwords, self.drones = known["first_passwords"], known["drones"]
            self.accounts = known.get("accounts", list(self.first_passwords))
            self._begun = known.get("begun", {})

    def token_file(self, drone: str) -> Path:
        """Where the drone's key is; before its agent's first start, the token that enrols it."""
        return self.tokens / f"{drone.lower().replace(' ', '-')}.token"

    def add_users(self, wanted: Mapping[str, tuple[str, str, bool]]) -> None:
        """Those that are not there yet: name to role, password, and whether somebody has chosen the password.

        One that somebody has chosen need not be changed at the first sign-in. Raises StepFailed if there is an account
        of such a name that was not made here: nobody's password is changed.
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
        """A first password that was changed opens nothing, and still says how somebody thinks up passwords.

        `accounts`: what `accounts_now` says.
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
        """Unless there is one already."""
        if name in self.drones:
            if self._is_not_enrolled(name):  # a token does not last as long as a folder
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
        """Whether the drone is there. The file may hold the token of a moment before: it gets a new one."""
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
