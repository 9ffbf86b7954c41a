"""Chooses the compressed copy of a file that a browser accepts: the build puts `name.br` and `name.gz` beside
`name`."""

from __future__ import annotations

from pathlib import Path
from typing import Final

ENDINGS: Final = {"br": ".br", "gzip": ".gz"}
"""By the name of the coding in the headers, smallest file first."""


def copy_for(file: Path, accept_encoding: str) -> tuple[Path, str | None]:
    """Returns the copy to send and its `Content-Encoding`, or the file itself and None. `accept_encoding`: the
    header."""
    accepted = accepted_codings(accept_encoding)
    for coding, ending in ENDINGS.items():
        copy = file.with_name(file.name + ending)
        if coding in accepted and copy.is_file():
            return copy, coding
    return file, None


def accepted_codings(accept_encoding: str) -> frozenset[str]:
    """Returns our codings that the header allows (RFC 9110, 12.5.3): `q=0` forbids one, `*` means those not named."""
    weights: dict[str, bool] = {}
    for item in accept_encoding.split(","):
        name, _, parameters = item.partition(";")
        weights[name.strip().lower()] = _weight(parameters) > 0
    others = weights.get("*", False)
    return frozenset(coding for coding in ENDINGS if weights.get(coding, others))


def _weight(parameters: str) -> float:
    name, _, value = parameters.partition("=")
    if name.strip().lower() != "q":
        return 1.0
    try:
        return float(value)
    except ValueError:
        return 0.0  # an unreadable weight counts as 0
