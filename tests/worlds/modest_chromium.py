"""Chromium that draws when nobody else has work."""

import os
import shlex
import shutil
from pathlib import Path


def modest(program: str, folder: Path) -> Path:
    """A script in `folder` that starts it.

    Run by root it would put its drawing above everything else on the machine: above the drones of this test, and of
    those beside it.
    """
    drop = "setpriv --bounding-set=-sys_nice " if os.geteuid() == 0 and shutil.which("setpriv") else ""
    script = folder / "chromium"
    script.write_text(f'#!/bin/sh\nexec {drop}nice -n 5 {shlex.quote(program)} "$@"\n')
    script.chmod(0o700)
    return script
