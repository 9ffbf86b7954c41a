import { describe, expect, it } from 'vitest';

import { outcomeWords, type Outcome } from '../../src/link/outcome';

describe('words', () => {
  const kinds: Outcome[] = [
    { kind: 'accepted' },
    { kind: 'no-answer' },
    { kind: 'unconfirmed', detail: 'its heartbeat disagrees' },
    { kind: 'failed', why: 'offline' },
    ...[1, 2, 3, 4, 6, 7, 8, 9, 10, 99].map((result): Outcome => ({ kind: 'refused', result })),
  ];
  it.each(kinds)('of $kind $result name the drone', (outcome) => {
    expect(outcomeWords('Heron', outcome)).toMatch(/^Heron/);
  });
  it('differ for each result', () => {
    expect(new Set(kinds.map((outcome) => outcomeWords('Heron', outcome))).size).toBe(kinds.length);
  });
});
