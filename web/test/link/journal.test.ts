import { describe, expect, it } from 'vitest';

import { foldedEntries, type Entry } from '../../src/link/journal';

const line = (key: string, text: string, changes: Partial<Entry> = {}): Entry => ({
  key,
  atMs: Number(key),
  droneId: 1,
  source: 'autopilot',
  severity: 'info',
  text,
  ...changes,
});

describe('repeated messages', () => {
  it('are one line with a count, where the newest stands', () => {
    const entries = [line('1', 'A'), line('2', 'B'), line('3', 'A'), line('4', 'B'), line('5', 'A'), line('6', 'C')];
    expect(foldedEntries(entries).map(({ entry, count }) => [entry.key, entry.text, count])).toEqual([
      ['4', 'B', 2],
      ['5', 'A', 3],
      ['6', 'C', 1],
    ]);
  });

  it('are those of one drone, source and severity', () => {
    const entries = [
      line('1', 'A'),
      line('2', 'A', { droneId: 2 }),
      line('3', 'A', { source: 'tower' }),
      line('4', 'A', { severity: 'error' }),
    ];
    expect(foldedEntries(entries)).toHaveLength(4);
  });
});
