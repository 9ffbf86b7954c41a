"""The process that hashes passwords: started by `hashing_process` with the number of threads.

Argon2 uses tens of megabytes per hash. In the tower's own process its threads would share the interpreter's lock and
the kernel's lock of the address space with the event loop; a thread preempted while it held one of them made frames
wait for up to 70 ms (docs/adr/0009-hashing-has-a-process-of-its-own.md).

Reads lines of JSON from standard input and writes one line to standard output for each, in order of completion. It ends
when its input closes, so also when the tower is killed. Imports no module of ours, because it starts with every tower.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Final

from passlib.hash import argon2

NICE: Final = 5
"""Hashing may use all idle processors; frames come first."""
PARALLELISM: Final = 4


def answer(question: dict[str, Any]) -> str | bool:
    """Returns the hash of `password`, or with `hash` whether the password matches it."""
    known = question.get("hash")
    if known is not None:
        return bool(argon2.verify(question["password"], known))
    hasher = argon2.using(
        type="ID", memory_cost=question["memory_kib"], rounds=question["rounds"], parallelism=PARALLELISM
    )
    return str(hasher.hash(question["password"]))


def main(words: list[str]) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):  # for the tower, which then closes our input: systemd signals all
        signal.signal(number, signal.SIG_IGN)
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))  # regardless of the tower's own priority
        os.nice(NICE)
    writing = threading.Lock()

    def work(line: bytes) -> None:
        question = json.loads(line)
        try:
            reply: dict[str, Any] = {"id": question["id"], "answer": answer(question)}
        except Exception as error:
            reply = {"id": question["id"], "error": type(error).__name__}
        with writing, contextlib.suppress(BrokenPipeError):
            sys.stdout.buffer.write(json.dumps(reply).encode() + b"\n")
            sys.stdout.buffer.flush()

    with ThreadPoolExecutor(int(words[0])) as threads:
        for line in sys.stdin.buffer:
            threads.submit(work, line)


if __name__ == "__main__":
    main(sys.argv[1:])
