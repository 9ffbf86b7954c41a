import { expect, it } from 'vitest';

import { logLines } from '../../src/link/log_rest';

const log = (id: number, size_bytes: number, began_at: string | null = null) => ({ id, size_bytes, began_at });
const kept = (id: number, size_bytes: number) => ({ ...log(id, size_bytes), kept_at: '2026-11-22T03:00:00Z' });

it('tells each log once, and which of them is where', () => {
  const lines = logLines({ read_at: null, on_board: [log(3, 900), log(2, 100)], kept: [kept(2, 100), kept(1, 50)] });
  expect(lines.map(({ id, isOnBoard, isKept }) => [id, isOnBoard, isKept])).toEqual([
    [3, true, false],
    [2, true, true],
    [1, false, true],
  ]);
});

it('takes a log of the same number and another size for another one', () => {
  const lines = logLines({ read_at: null, on_board: [log(1, 900)], kept: [kept(1, 100)] });
  expect(lines.map(({ isOnBoard, isKept }) => [isOnBoard, isKept])).toEqual([
    [true, false],
    [false, true],
  ]);
});

it('tells what the tower has where nobody has asked the autopilot', () => {
  expect(logLines({ read_at: null, on_board: null, kept: [kept(1, 100)] })).toHaveLength(1);
});
