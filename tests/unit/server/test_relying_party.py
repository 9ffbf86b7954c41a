"""The tower addresses for which browsers make passkeys."""

import pytest

from server.accounts.core.relying_party import PasskeysUnavailable, RelyingParty, relying_party


@pytest.mark.parametrize(
    ("public_url", "host", "found"),
    [
        ("https://tower.example.org", "elsewhere.example", ("tower.example.org", "https://tower.example.org")),
        ("https://Tower.Example.org:443", "", ("tower.example.org", "https://tower.example.org")),
        ("https://tower.example.org:8443", "", ("tower.example.org", "https://tower.example.org:8443")),
        ("https://türme.example", "", ("xn--trme-0ra.example", "https://xn--trme-0ra.example")),
        ("http://localhost:9000", "127.0.0.1:8000", ("localhost", "http://localhost:9000")),
        ("http://tower.localhost", "", ("tower.localhost", "http://tower.localhost")),
        ("", "localhost:8000", ("localhost", "http://localhost:8000")),
        ("", "LOCALHOST", ("localhost", "http://localhost:8000")),
        # A Host header opens no other port than the tower's own.
        ("", "localhost:3000", ("localhost", "http://localhost:8000")),
    ],
)
def test_an_address_for_which_there_are_passkeys(public_url: str, host: str, found: tuple[str, str]) -> None:
    assert relying_party(public_url=public_url, host=host, port=8000) == RelyingParty(*found)


@pytest.mark.parametrize(
    ("public_url", "host", "words"),
    [
        ("", "127.0.0.1:8000", "set TOWER_PUBLIC_URL"),
        ("", "tower.example.org", "set TOWER_PUBLIC_URL"),
        ("", "localhost.evil.example", "set TOWER_PUBLIC_URL"),
        ("", "localhost@evil.example", "set TOWER_PUBLIC_URL"),
        ("", "", "http://localhost:8000"),
        ("https://192.0.2.7", "localhost", "not for addresses like 192.0.2.7"),
        ("https://[2001:db8::7]:8443", "localhost", "not for addresses like 2001:db8::7"),
        ("http://tower.example.org", "localhost", "over https only"),
    ],
)
def test_an_address_for_which_there_are_none_says_what_to_do(public_url: str, host: str, words: str) -> None:
    with pytest.raises(PasskeysUnavailable, match=words):
        relying_party(public_url=public_url, host=host, port=8000)
