"""Which compressed copy of a file a browser accepts."""

import pytest

from server.http.content_coding import accepted_codings


@pytest.mark.parametrize(
    ("header", "accepted"),
    [
        ("", set()),
        ("identity", set()),
        ("gzip, deflate, br, zstd", {"br", "gzip"}),
        ("GZIP", {"gzip"}),
        ("gzip;q=1.0, br;q=0", {"gzip"}),
        ("br; q=0.5", {"br"}),
        ("*", {"br", "gzip"}),
        ("*, br;q=0", {"gzip"}),
        ("*;q=0, gzip", {"gzip"}),
        ("br;q=much", set()),
        (";;,=,q", set()),
    ],
)
def test_what_the_header_allows(header: str, accepted: set[str]) -> None:
    assert accepted_codings(header) == accepted
