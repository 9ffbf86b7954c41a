import { describe, expect, it } from 'vitest';

import { causeWords, holdWords } from '../../src/link/event_words';
import { nextHold, type HoldLog } from '../../src/link/hold_log';
import type { HoldEvent } from '../../src/link/wire_types';

const hold = (step: string, more: Partial<HoldEvent> = {}): HoldEvent => ({
  type: 'hold',
  drone_id: 1,
  epoch: 2,
  step,
  detail: '',
  elapsed_ms: 0,
  cause: 'order',
  ...more,
});

function logOf(...events: HoldEvent[]): HoldLog {
  const log = events.reduce<HoldLog | null>((last, event, at) => nextHold(last, event, 1_000 + at), null);
  return log!;
}

describe('the log of a hold', () => {
  it('collects the steps of one hold and the time to its confirmation', () => {
    const log = logOf(
      hold('ordered'),
      hold('sticks_centred'),
      hold('mode_requested'),
      hold('confirmed', { elapsed_ms: 12 }),
    );
    expect(log.steps.map(({ step }) => step)).toEqual(['ordered', 'sticks_centred', 'mode_requested', 'confirmed']);
    expect(log).toMatchObject({ phase: 'confirmed', confirmedMs: 12, beganMs: 1_000, changedMs: 1_003 });
  });

  it('begins again with an order, another epoch, another cause, or after its end', () => {
    const done = [hold('ordered'), hold('confirmed', { elapsed_ms: 5 })] as const;
    for (const next of [
      hold('ordered'),
      hold('ordered', { epoch: 3 }),
      hold('sticks_centred', { cause: 'sticks-stale' }),
      hold('sticks_centred'),
    ]) {
      expect(logOf(...done, next)).toMatchObject({ phase: 'running', confirmedMs: null, steps: [{ step: next.step }] });
    }
  });

  it('may still be confirmed after it was not', () => {
    const log = logOf(hold('ordered'), hold('unconfirmed'), hold('confirmed', { elapsed_ms: 900 }));
    expect(log).toMatchObject({ phase: 'confirmed', confirmedMs: 900 });
    expect(log.steps).toHaveLength(3);
  });

  it('stays unconfirmed while it goes on trying', () => {
    expect(logOf(hold('ordered'), hold('unconfirmed'), hold('mode_requested')).phase).toBe('unconfirmed');
  });

  it('keeps the reason of an order', () => {
    const ordered = hold('ordered', { detail: 'airspace closed.' });
    const log = logOf(ordered, hold('sticks_centred', { detail: 'ALT_HOLD' }), hold('confirmed', { detail: 'BRAKE' }));
    expect(log.reason).toBe('airspace closed.');
    expect(causeWords(log.cause, log.reason)).toBe('ordered by the tower: airspace closed');
    // The agent's own hold has details, but no reason of the tower.
    expect(logOf(hold('ordered', { detail: 'BRAKE', cause: 'sticks-stale' })).reason).toBe('');
    expect(causeWords('sticks-stale', 'x')).toBe('the sticks stopped or came too late');
    expect(logOf(ordered, hold('confirmed'), hold('ordered')).reason).toBe('');
  });

  it('keeps the reason when the second of two orders is confirmed after the first', () => {
    const log = logOf(
      hold('ordered', { detail: 'not confirmed by the database yet' }),
      hold('ordered', { detail: 'airspace closed' }),
      hold('confirmed', { elapsed_ms: 5 }),
      hold('confirmed', { elapsed_ms: 9 }),
    );
    expect(log).toMatchObject({ reason: 'airspace closed', phase: 'confirmed', confirmedMs: 9 });
  });

  it('is bounded, and takes an older tower without a cause', () => {
    const many = Array.from({ length: 50 }, () => hold('mode_requested', { cause: undefined as never }));
    expect(logOf(...many).steps.length).toBeLessThan(20);
    expect(logOf(...many).cause).toBe('order');
  });

  it('says why in words', () => {
    expect(causeWords('sticks-stale')).toBe('the sticks stopped or came too late');
    expect(causeWords('tomorrow')).toBe('tomorrow');
    expect(holdWords(hold('unconfirmed', { elapsed_ms: 800.4, detail: 'no answer', cause: 'pilot-lost' }))).toBe(
      'Hold NOT CONFIRMED after 800 ms (the pilot or the tower was lost): no answer',
    );
  });
});
