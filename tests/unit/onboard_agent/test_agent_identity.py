"""The drone's key and its file: the stored state signs in after each step, and only its owner can read it."""

import os
import stat
from pathlib import Path

import pytest

from onboard_agent.link import identity_file
from onboard_agent.link.identity import Identity, Kept, MalformedIdentity, NotKept, parse_kept
from onboard_agent.link.identity_file import enrolment_token, read_identity, write_private
from onboard_agent.unusable import Unusable
from wire.credential import Credential
from wire.drone_key import DroneKey
from wire.ids import DroneId

SEVEN = DroneId(7)
KEY = DroneKey(SEVEN, b"k" * 32)
CREDENTIAL = Credential(SEVEN, "c" * 43)
TOWER = b"T" * 32
ALL = Kept(SEVEN, KEY, CREDENTIAL, TOWER)


@pytest.mark.parametrize(
    "kept", [ALL, Kept(SEVEN, KEY), Kept(SEVEN, None, CREDENTIAL), Kept(SEVEN, KEY, None, TOWER)], ids=range(4)
)
def test_what_is_kept_reads_as_it_is_written(kept: Kept) -> None:
    assert parse_kept(str(kept)) == kept
    assert CREDENTIAL.secret not in repr(kept)
    assert str(KEY)[6:] not in repr(kept)


@pytest.mark.parametrize(
    "text", ["", "nonsense", f"{KEY}\ntwd_8_{'c' * 43}", f"twp_{'A' * 43}", f"{KEY}\ntwp_short", f"{KEY} more"]
)
def test_what_is_nobodys_identity(text: str) -> None:
    with pytest.raises(MalformedIdentity) as caught:
        parse_kept(text)
    assert str(KEY)[6:] not in str(caught.value)


def test_an_exchange_is_kept_step_by_step() -> None:
    written: list[Kept] = []
    identity = Identity(Kept(SEVEN, None, CREDENTIAL), written.append)
    key = identity.make_key()
    assert written == [Kept(SEVEN, key, CREDENTIAL)], "the key is there before anybody is told, and nothing is lost"
    assert identity.make_key() is key, "a second try shows the same one"
    identity.welcomed(TOWER)
    assert written[1:] == [Kept(SEVEN, key, None, TOWER)]
    identity.welcomed(TOWER)
    assert len(written) == 2, "a card is not written at each sign-in"


def test_a_key_that_cannot_be_kept_is_shown_to_nobody() -> None:
    identity = Identity(Kept(SEVEN, None, CREDENTIAL))
    with pytest.raises(NotKept):
        identity.make_key()
    assert (identity.key, identity.credential) == (None, CREDENTIAL)
    identity = Identity(Kept(SEVEN, KEY, CREDENTIAL))
    with pytest.raises(NotKept):
        identity.welcomed(TOWER)
    assert (identity.key, identity.credential, identity.tower_key) == (KEY, CREDENTIAL, None)


def test_the_file_is_its_owners_alone_and_whole_or_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "token"
    file.write_text(f"{CREDENTIAL}\n")
    file.chmod(0o644)
    identity = read_identity(file)
    key = identity.make_key()
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert (read_identity(file).key, read_identity(file).credential) == (key, CREDENTIAL)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    before = file.read_text()
    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        with pytest.raises(NotKept, match="No space left"):
            identity.welcomed(TOWER)
    assert file.read_text() == before
    assert list(tmp_path.iterdir()) == [file], "no draft with the key in it is left"
    identity.welcomed(TOWER)
    assert read_identity(file).credential is None
    assert CREDENTIAL.secret not in file.read_text()


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o660, 0o622, 0o644])
def test_a_key_that_others_can_read_is_refused(tmp_path: Path, mode: int) -> None:
    file = tmp_path / "token"
    write_private(file, f"{KEY}\n")
    assert read_identity(file).key == KEY
    file.chmod(mode)
    with pytest.raises(Unusable, match=f"can be read by others on this machine .mode {mode:o}.: chmod 600") as caught:
        read_identity(file)
    assert str(KEY)[6:] not in str(caught.value)


def test_systemds_copy_may_be_the_groups_but_not_everybodys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CREDENTIALS_DIRECTORY", str(tmp_path))
    file = tmp_path / "token"
    write_private(file, f"{KEY}\n")
    file.chmod(0o440)
    assert read_identity(file).key == KEY
    file.chmod(0o444)
    with pytest.raises(Unusable, match="can be read by others"):
        read_identity(file)


def test_where_the_file_is_systemds_the_key_is_kept_with_the_state(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    credentials, state = tmp_path / "credentials", tmp_path / "state" / "drone-7"
    credentials.mkdir()
    monkeypatch.setenv("CREDENTIALS_DIRECTORY", str(credentials))
    file = credentials / "token"
    file.write_text(f"{CREDENTIAL}\n")
    file.chmod(0o400)

    def again() -> Identity:
        return read_identity(file, lambda drone_id: tmp_path / "state" / f"drone-{drone_id}")

    key = again().make_key()
    assert stat.S_IMODE((state / "key").stat().st_mode) == 0o600
    assert (again().key, again().credential) == (key, CREDENTIAL)
    again().welcomed(TOWER)
    assert (again().key, again().tower_key) == (key, TOWER)
    assert CREDENTIAL.secret not in (state / "key").read_text()
    assert file.read_text() == f"{CREDENTIAL}\n", "it is not ours"
    file.chmod(0o600)
    file.write_text(f"{KEY}\n")
    assert again().key == KEY, "an enrolment of today counts more than an exchange of once"


def test_an_enrolment_token_is_told_from_an_identity(tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.write_text("twe_abc\n")
    assert enrolment_token(file) == "twe_abc"
    with pytest.raises(Unusable, match="does not contain a drone's key"):
        read_identity(file)
    file.write_text(f"{KEY}\n")
    assert enrolment_token(file) is None


def test_a_key_of_another_user_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "token"
    write_private(file, f"{KEY}\n")
    monkeypatch.setattr(identity_file, "_SUPERUSER", -1)
    monkeypatch.setattr(os, "geteuid", lambda: file.stat().st_uid + 1)
    with pytest.raises(Unusable, match="belongs to another user"):
        read_identity(file)
