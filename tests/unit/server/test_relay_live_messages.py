"""Valid text messages from a browser: all others are reported as malformed, whatever their content."""

import pytest

from server.live.live_messages import Focus, MalformedRequest, Pong, Watch, decode_request


def test_the_three_requests_are_understood_and_unknown_fields_ignored() -> None:
    assert decode_request('{"type":"watch","rate_hz":5,"more":[1]}') == Watch(5.0)
    assert decode_request('{"type":"focus","drone_id":null}') == Focus(None)
    assert decode_request('{"type":"pong","sequence":3}') == Pong(3)


@pytest.mark.parametrize(
    "text",
    [
        '{"type":"watch","rate_hz":5,"more":' + "[" * 60_000,
        '{"type":"watch","rate_hz":1e999}',
        '{"type":"watch","rate_hz":NaN}',
        '{"type":"watch","rate_hz":"5"}',
        '{"type":"focus","drone_id":' + "9" * 5000 + "}",
        '{"type":"pong","sequence":-1}',
        '{"type":"fly"}',
        '{"type":"\\ud800"}',
        "[]",
        "",
    ],
    ids=[
        "nested",
        "infinite",
        "not a number",
        "a text",
        "huge",
        "negative",
        "unknown",
        "half a character",
        "list",
        "empty",
    ],
)
def test_everything_else_is_malformed(text: str) -> None:
    with pytest.raises(MalformedRequest):
        decode_request(text)
