"""The vault: sealed data opens only with its keys and for its purpose."""

from pathlib import Path

import pytest

from server.runtime.vault import Vault, VaultError, new_key, parse_keys

ABOUT = "second factor of user 7"


def with_keys(*keys: str) -> Vault:
    return Vault(keys=keys, key_file=Path("/nowhere/secret.key"))


def test_what_is_sealed_opens_and_never_looks_alike_twice() -> None:
    vault = with_keys(new_key())
    first, second = vault.seal("JBSWY3DP", about=ABOUT), vault.seal("JBSWY3DP", about=ABOUT)
    assert first != second
    assert "JBSWY3DP" not in first
    assert vault.open(first, about=ABOUT) == vault.open(second, about=ABOUT) == "JBSWY3DP"
    assert len(vault.seal("A" * 32, about=f"second factor of user {2**31}")) <= 255, "the column is no wider"


def test_it_opens_for_nobody_else_and_not_when_damaged() -> None:
    vault = with_keys(new_key())
    sealed = vault.seal("JBSWY3DP", about=ABOUT)
    for broken, about in ((sealed, "second factor of user 8"), (sealed[:-8] + "AAAAAAA=", ABOUT), ("", ABOUT)):
        with pytest.raises(VaultError) as caught:
            vault.open(broken, about=about)
        assert "JBSWY3DP" not in str(caught.value)
    with pytest.raises(VaultError, match="cannot be opened"):
        with_keys(new_key()).open(sealed, about=ABOUT)


def test_a_new_key_goes_first_and_the_old_one_may_go_then() -> None:
    old, new = new_key(), new_key()
    sealed = with_keys(old).seal("JBSWY3DP", about=ABOUT)
    both = with_keys(new, old)
    assert not both.by_newest_key(sealed)
    again = both.reseal(sealed)
    assert both.by_newest_key(again)
    assert with_keys(new).open(again, about=ABOUT) == "JBSWY3DP"
    with pytest.raises(VaultError):
        with_keys(new).open(sealed, about=ABOUT)


def test_the_key_file_is_made_once_and_for_its_owner_only(tmp_path: Path) -> None:
    key_file = tmp_path / "var" / "secret.key"
    vault = Vault(key_file=key_file)
    assert not vault.find_keys()
    with pytest.raises(VaultError, match="TOWER_SECRET_KEYS is not set"):
        vault.seal("x", about=ABOUT)
    vault.make_key()
    kept = key_file.read_text()
    assert key_file.stat().st_mode & 0o777 == 0o600
    assert [one.name for one in key_file.parent.iterdir()] == ["secret.key"]
    other = Vault(key_file=key_file)
    other.make_key()
    assert key_file.read_text() == kept
    assert other.open(vault.seal("x", about=ABOUT), about=ABOUT) == "x"


@pytest.mark.parametrize(
    "text",
    ["", "\n", "not a key\n", f"{new_key()}\nshort\n"],
    # Explicit ids: a random key in an id would differ between workers, which must collect the same tests.
    ids=["empty", "an empty line", "words", "a key and something else"],
)
def test_a_key_file_with_something_else_is_named_and_not_shown(tmp_path: Path, text: str) -> None:
    key_file = tmp_path / "secret.key"
    key_file.write_text(text)
    with pytest.raises(VaultError) as caught:
        Vault(key_file=key_file).find_keys()
    assert str(key_file) in str(caught.value)
    assert not text.strip() or text.strip() not in str(caught.value)


def test_keys_are_read_newest_first() -> None:
    first, second = new_key(), new_key()
    assert parse_keys(f" {first} , {second}", ",") == (first, second)
