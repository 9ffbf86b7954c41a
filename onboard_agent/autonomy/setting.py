"""The agent's setting `controllers`: names and files of controllers. Pure."""

import re
from collections.abc import Mapping, Sequence
from typing import Final

from onboard_agent.unusable import Unusable

FORM: Final = "NAME=/FILE.py:CLASS"
_FORM: Final = re.compile(r"([a-z][a-z0-9_-]{0,39})=(/[^:]+\.py:[A-Za-z_]\w*)")


def parse_controllers(texts: Sequence[str]) -> Mapping[str, str]:
    """Returns FILE:CLASS by name. Raises Unusable."""
    found: dict[str, str] = {}
    for text in texts:
        match = _FORM.fullmatch(text)
        if match is None:
            raise Unusable(f"controllers: {text!r} is not of the form {FORM}, with the file's whole path")
        name, source = match.groups()
        if name in found:
            raise Unusable(f"controllers: {name} is there twice")
        found[name] = source
    return found
