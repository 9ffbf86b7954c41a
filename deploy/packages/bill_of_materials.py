"""The list of what a distribution contains, as CycloneDX 1.6 (an SBOM): its Python packages, and the console's.

Versions and hashes come from the lock files, which name what was installed; licences from the packages themselves.
"""

from __future__ import annotations

import base64
import json
import re
import uuid
from collections.abc import Iterator, Mapping
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path
from typing import Any, Final

from packaging.markers import Marker

_PIN: Final = re.compile(r"^([A-Za-z0-9._-]+)==([^ ;\\]+)(?: ;([^\\]+))?")
_IMPORT: Final = re.compile(r"""(?:from|import)\s*\(?\s*['"](@?[a-z][^'"]*)['"]""")
_HASH: Final = re.compile(r"--hash=sha256:([0-9a-f]{64})")


def bill_of_materials(
    name: str, version: str, lock: Path, *, moment: str, console: Path | None = None
) -> dict[str, Any]:
    """Returns the document. `moment`: of the commit, in ISO 8601. `console`: the package-lock.json of the console."""
    components = [*python_packages(lock), *(npm_packages(console) if console else ())]
    subject = {"type": "application", "bom-ref": f"{name}@{version}", "name": name, "version": version}
    subject["purl"] = f"pkg:pypi/{name}@{version}"
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        # The same content has the same number.
        "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, json.dumps([subject, components]))}",
        "version": 1,
        "metadata": {"timestamp": moment, "component": subject},
        "components": components,
        "dependencies": [{"ref": subject["bom-ref"], "dependsOn": [one["bom-ref"] for one in components]}],
    }


def python_packages(lock: Path, environment: Mapping[str, str] | None = None) -> list[dict[str, Any]]:
    """Returns what a lock file of pip pins for this environment (by default that of this process)."""
    found = []
    for entry in _entries(lock.read_text(encoding="utf-8")):
        pin = _PIN.match(entry)
        if pin is None:
            continue
        name, version, marker = pin[1], pin[2], pin[3]
        if marker and not Marker(marker.strip()).evaluate(dict(environment or {})):
            continue
        reference = f"pkg:pypi/{name}@{version}"
        found.append(
            {"type": "library", "bom-ref": reference, "name": name, "version": version, "purl": reference}
            | _licence(name)
            | {"properties": _files(entry)}
        )
    return found


def _entries(text: str) -> Iterator[str]:
    yield from (part for part in re.split(r"\n(?=\S)", text) if part and not part.startswith("#"))


def _files(entry: str) -> list[dict[str, str]]:
    """A lock file has the hash of every file of a version; one of them was installed, so none is *the* hash."""
    return [{"name": "control-tower:locked-sha256", "value": one} for one in sorted(_HASH.findall(entry))]


def _licence(name: str) -> dict[str, Any]:
    try:
        found = metadata(name)
    except PackageNotFoundError:  # of another platform
        return {}
    expression = found.get("License-Expression")
    if expression:
        return {"licenses": [{"expression": expression}]}
    classifiers = [one.split(" :: ")[-1] for one in found.get_all("Classifier") or () if one.startswith("License ::")]
    names = classifiers or [text for text in [(found.get("License") or "").strip()] if 0 < len(text) < 80]
    return {"licenses": [{"license": {"name": one}} for one in names]} if names else {}


def npm_packages(lock: Path) -> list[dict[str, Any]]:
    """Returns what the console contains: what its sources import, and what that depends on. Every package is a tool of
    development to npm, because the build leaves no package behind. Svelte is compiled in, so it is imported."""
    known = json.loads(lock.read_text(encoding="utf-8"))["packages"]
    waiting, found = sorted(_imported(lock.parent / "src")), {}
    while waiting:
        name = waiting.pop()
        one = known.get(f"node_modules/{name}")
        if one is None or name in found:
            continue
        waiting += sorted(one.get("dependencies", {}))
        found[name] = _npm_package(name, one)
    return [found[name] for name in sorted(found)]


def _imported(folder: Path) -> set[str]:
    """Returns the packages that sources import by name: `a` of `a/b`, `@a/b` of `@a/b/c`."""
    texts = (path.read_text(encoding="utf-8") for path in folder.rglob("*") if path.suffix in {".ts", ".svelte"})
    named = {name for text in texts for name in _IMPORT.findall(text)}
    return {"/".join(name.split("/")[: 2 if name.startswith("@") else 1]) for name in named}


def _npm_package(name: str, one: Mapping[str, Any]) -> dict[str, Any]:
    reference = f"pkg:npm/{name.replace('@', '%40', 1)}@{one['version']}"
    component: dict[str, Any] = {"type": "library", "bom-ref": reference, "name": name, "version": one["version"]}
    component["purl"] = reference
    if "license" in one:
        component["licenses"] = [{"expression": one["license"]}]
    algorithm, _, digest = one.get("integrity", "").partition("-")
    if algorithm == "sha512":
        component["hashes"] = [{"alg": "SHA-512", "content": base64.b64decode(digest).hex()}]
    return component
