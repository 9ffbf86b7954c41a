import { describe, expect, it } from 'vitest';

import { nextRehearsal } from '../../src/link/rehearsal_log';
import type { RehearsalEvent } from '../../src/link/wire_types';

const event = (phase: string, text: string, hold_ms: number | null = null): RehearsalEvent => ({
  type: 'rehearsal',
  drone_id: 1,
  what: 'tower',
  phase,
  hold_ms,
  text,
});

describe('what is seen of a rehearsal', () => {
  it('keeps the measured time and the words about it when it is over', () => {
    const held = nextRehearsal(event('begun', 'begun'), event('held', 'In LOITER', 2003));
    expect(held).toMatchObject({ phase: 'held', hold_ms: 2003 });
    expect(nextRehearsal(held, event('ended', 'over'))).toMatchObject({
      phase: 'ended',
      hold_ms: 2003,
      text: 'In LOITER',
    });
  });

  it('keeps a failure', () => {
    const failed = event('failed', 'no hold');
    expect(nextRehearsal(failed, event('ended', 'over'))).toBe(failed);
    expect(nextRehearsal(failed, event('begun', 'again'))).toMatchObject({ phase: 'begun', text: 'again' });
  });

  it('takes an end without a beginning', () => {
    expect(nextRehearsal(null, event('ended', 'over'))).toMatchObject({ phase: 'ended', text: 'over' });
  });
});
