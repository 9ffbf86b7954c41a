"""`python -m bench.characters.train`: trains the agent's reader of characters, and writes its weights.

Takes about eight minutes of one processor. The same seed and the same typefaces give the same weights, but for the
rounding of another processor. `faces.PACKAGES` are the typefaces' packages.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from bench.characters.faces import CHECKING, TRAINING, installed
from bench.characters.samples import NONE, Floats, samples
from onboard_agent.vision.characters import WEIGHTS, Network, features_of
from onboard_agent.vision.letter_reading import CHARACTERS

HIDDEN: Final = 192
POOL: Final = 24_000
BATCH: Final = 128
PASSES: Final = 3
"""Over each pool of samples, which then gives way to a new one."""
CLASSES: Final = len(CHARACTERS) + 1


def turned_features(glyphs: Floats) -> Floats:
    """Returns (n, 4, features), of each quarter turn."""
    return np.stack([features_of(np.rot90(glyphs, turn, axes=(1, 2))) for turn in range(4)], axis=1)


def joint(logits: Floats) -> Floats:
    """Returns the logs of probabilities (n, 4 * characters + 1) from logits (n, 4, characters and "none")."""
    count = len(logits)
    rows = np.concatenate([logits[:, :, :-1].reshape(count, -1), logits[:, :, -1].mean(axis=1)[:, None]], axis=1)
    rows = rows - rows.max(axis=1, keepdims=True)
    return np.asarray(rows - np.log(np.exp(rows).sum(axis=1, keepdims=True)), np.float32)


class Adam:
    """The usual optimiser, for one array."""

    def __init__(self, value: Floats) -> None:
        self.value, self._first, self._second, self._count = value, np.zeros_like(value), np.zeros_like(value), 0

    def step(self, gradient: Floats, rate: float) -> None:
        self._count += 1
        self._first += 0.1 * (gradient - self._first)
        self._second += 0.001 * (gradient * gradient - self._second)
        first, second = self._first / (1 - 0.9**self._count), self._second / (1 - 0.999**self._count)
        self.value -= (rate * (first / (np.sqrt(second) + 1e-8) + 1e-4 * self.value)).astype(np.float32)


def train(seed: int, rounds: int, out: Path) -> None:
    """Writes the weights after each round."""
    rng = np.random.default_rng(seed)
    faces, checking = installed(TRAINING), installed(CHECKING)
    print(f"{len(faces)} faces train, {len(checking)} check", flush=True)
    check_glyphs, check_classes = samples(checking, 6_000, np.random.default_rng(seed + 1))
    check = turned_features(check_glyphs)
    width = check.shape[2]
    hidden = Adam((rng.normal(0, 1, (width + 1, HIDDEN)) * np.sqrt(2 / width)).astype(np.float32))
    output = Adam((rng.normal(0, 1, (HIDDEN + 1, CLASSES)) * np.sqrt(1 / HIDDEN)).astype(np.float32))
    for done in range(rounds):
        began = time.monotonic()
        glyphs, classes = samples(faces, POOL, rng)
        features = turned_features(glyphs)
        rate = 2e-3 * 0.5 * (1 + np.cos(np.pi * done / rounds)) + 2e-5
        for _ in range(PASSES):
            order = rng.permutation(POOL)
            for at in range(0, POOL, BATCH):
                chosen = order[at : at + BATCH]
                _learn(hidden, output, features[chosen], classes[chosen], float(rate), rng)
        made = Network(hidden.value, output.value)
        save(made, out)
        logits = made.logits(check.reshape(-1, width)).reshape(-1, 4, CLASSES)
        best = joint(logits).argmax(axis=1)
        truth = np.where(check_classes == NONE, 4 * NONE, check_classes)
        right = float((best == truth).mean())
        named = (best % NONE == check_classes) & (best < 4 * NONE)
        characters = float(named[check_classes != NONE].mean())
        print(f"{done + 1}: all {right:.4f}, characters {characters:.4f}, {time.monotonic() - began:.0f} s", flush=True)


def _learn(
    hidden: Adam, output: Adam, features: Floats, classes: Floats, rate: float, rng: np.random.Generator
) -> None:
    count, _, width = features.shape
    rows = features.reshape(-1, width)
    inner = np.maximum(rows @ hidden.value[:-1] + hidden.value[-1], 0.0)
    kept = (rng.random((count, 1, HIDDEN)) < 0.8).astype(np.float32).repeat(4, axis=1).reshape(-1, HIDDEN) / 0.8
    dropped = inner * kept
    logits = (dropped @ output.value[:-1] + output.value[-1]).reshape(count, 4, CLASSES)
    error = np.exp(joint(logits))
    error[np.arange(count), np.where(classes == NONE, 4 * NONE, classes)] -= 1.0
    back = np.empty((count, 4, CLASSES), np.float32)
    back[:, :, :-1] = error[:, :-1].reshape(count, 4, NONE)
    back[:, :, -1] = error[:, -1:] / 4.0
    back = back.reshape(-1, CLASSES) / count
    inner_back = (back @ output.value[:-1].T) * kept * (inner > 0)
    output.step(np.vstack([dropped.T @ back, back.sum(axis=0)]), rate)
    hidden.step(np.vstack([rows.T @ inner_back, inner_back.sum(axis=0)]), rate)


def save(made: Network, path: Path) -> None:
    """Each column in 256 steps of its own: a quarter of the size, and the same readings."""
    kept = {}
    for name, values in made._asdict().items():
        step = np.abs(values).max(axis=0) / 127.0
        kept[name] = np.round(values / step).astype(np.int8)
        kept[f"{name}_step"] = step.astype(np.float32)
    np.savez_compressed(path, **kept)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--rounds", type=int, default=7)
    options.add_argument("--out", type=Path, default=WEIGHTS)
    said = options.parse_args()
    cv2.setNumThreads(1)
    train(said.seed, said.rounds, said.out)


if __name__ == "__main__":
    main()
