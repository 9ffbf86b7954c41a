"""The tower's address for agents: never one taken from a request."""

import pytest

from server.fleet.io.tower_address import AddressUnknown, address_for_agents
from server.runtime.settings import Settings


@pytest.mark.parametrize(
    ("bound", "base_url", "address"),
    [
        ("127.0.0.1", "http://127.0.0.1:8000/", "http://127.0.0.1:8000"),
        ("127.0.0.1", "http://localhost:8000/", "http://localhost:8000"),
        ("::1", "http://[::1]:8000/", "http://[::1]:8000"),
        ("192.0.2.7", "https://192.0.2.7/", "https://192.0.2.7"),
        ("0.0.0.0", "http://127.8.8.8:1/", "http://127.8.8.8:1"),
    ],
)
def test_of_a_request_only_what_is_ours(bound: str, base_url: str, address: str) -> None:
    assert address_for_agents(Settings(host=bound), base_url) == address


@pytest.mark.parametrize(
    "base_url",
    [
        "http://evil.example/",
        "http://192.0.2.8:8000/",
        "http://0.0.0.0/",
        "http://127.0.0.1.evil.example/",
        "http://127.0.0.1@evil.example/",
        "http://localhost.evil.example/",
        "http://x;reboot/",
        "http://[::1/",
        "http://127.0.0.1:port/",
        "ftp://127.0.0.1/",
        "http:///",
        "",
    ],
)
@pytest.mark.parametrize("bound", ["127.0.0.1", "0.0.0.0", "192.0.2.7"])
def test_anything_else_is_refused_with_what_to_do(bound: str, base_url: str) -> None:
    with pytest.raises(AddressUnknown, match="TOWER_PUBLIC_URL"):
        address_for_agents(Settings(host=bound), base_url)


def test_what_is_set_counts_alone() -> None:
    settings = Settings(public_url="https://tower.example.org")
    assert address_for_agents(settings, "http://evil.example/") == "https://tower.example.org"
