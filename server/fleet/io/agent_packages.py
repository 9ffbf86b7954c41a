"""The folder of the agent's releases: which packages are there, and what each says about itself.

The tower does not judge their signatures: it has no release key, and each agent believes its own alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from wire.agent_update import MAX_HEAD_BYTES, MAX_PACKAGE_BYTES, BadPackage, open_head, version_key

ENDING: Final = ".update"
MAX_PACKAGES: Final = 100


@dataclass(frozen=True)
class AgentPackage:
    version: str
    path: Path
    bytes: int


class AgentPackages:
    """Reads the folder at each call: a file put there can be chosen at once. Blocks; call it in a thread."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def all(self) -> list[AgentPackage]:
        """Those that can be read, newest first; of one version the file that comes last by its name."""
        found = {}
        try:
            files = sorted(self._folder.glob(f"*{ENDING}"))[:MAX_PACKAGES]
        except OSError:
            return []
        for path in files:
            try:
                with path.open("rb") as file:
                    head = open_head(file.read(MAX_HEAD_BYTES)).head
                size = path.stat().st_size
            except (OSError, BadPackage):
                continue
            if size <= MAX_PACKAGE_BYTES:
                found[head.version] = AgentPackage(head.version, path, size)
        return sorted(found.values(), key=lambda one: version_key(one.version), reverse=True)

    def find(self, version: str) -> AgentPackage | None:
        return next((one for one in self.all() if one.version == version), None)
