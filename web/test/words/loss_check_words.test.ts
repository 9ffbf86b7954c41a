import { describe, expect, it } from 'vitest';

import type { LossCheck } from '../../src/link/safety_types';
import { lossCheckSummary } from '../../src/words/loss_check_words';

const INFO = { about: 'operator', severity: 'info', text: 'It holds.' } as const;
const WARNING = { ...INFO, severity: 'warning', text: 'It drifts.' } as const;
const check = (changes: Partial<LossCheck>): LossCheck =>
  ({ dangerous: false, acknowledged: false, complete: true, sentences: [INFO], ...changes }) as LossCheck;

describe('the check before flight in a few words', () => {
  it('is good only where nothing warns', () => {
    expect(lossCheckSummary(check({}))).toEqual({ words: 'no danger found', tone: 'good' });
    expect(lossCheckSummary(check({ sentences: [INFO, WARNING] }))).toEqual({
      words: 'no danger, 1 warning',
      tone: 'warning',
    });
    expect(lossCheckSummary(check({ sentences: [WARNING, WARNING] })).words).toBe('no danger, 2 warnings');
  });

  it('says what is not known, and what must be read', () => {
    expect(lossCheckSummary(check({ complete: false }))).toEqual({ words: 'incomplete', tone: 'unknown' });
    expect(lossCheckSummary(check({ dangerous: true }))).toEqual({ words: 'DANGEROUS, not read yet', tone: 'danger' });
    expect(lossCheckSummary(check({ dangerous: true, acknowledged: true })).words).toBe('dangerous, acknowledged');
  });
});
