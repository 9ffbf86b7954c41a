import { describe, expect, it } from 'vitest';

import { readHold, type HoldReading } from '../../src/link/hold_view';
import type { HoldView } from '../../src/link/wire_types';
import { A_HOLD } from './fakes';

const NOW_MS = 1_000_000;
const CONTEXT = { droneName: 'Kestrel', lostActionS: 30, towerLagMs: 0 };
const QUIET: Partial<HoldView> = { lost: null, phase: 'quiet', action: null, due_at: null };
const read = (changes: Partial<HoldView> = {}, nowMs = NOW_MS, context = CONTEXT): HoldReading =>
  readHold({ ...A_HOLD, ...changes }, context, nowMs)!;

describe('a hold in words', () => {
  it('is nothing where there is none', () => {
    expect(readHold(null, CONTEXT, NOW_MS)).toBeNull();
  });

  it.each<[Partial<HoldView>, string, string]>([
    [{}, 'Kestrel holds: BRAKE, stays by itself.', 'Holds: BRAKE'],
    [{ sticks: true }, 'Kestrel holds: BRAKE, sticks kept by its agent.', 'Holds: BRAKE'],
    [
      { stage: 'altitude', waiting_for: 'no position.' },
      'Kestrel holds height only: no position.',
      'Holds height only',
    ],
    [{ stage: 'altitude' }, 'Kestrel holds height only: still slowing down.', 'Holds height only'],
    [{ stage: 'none' }, 'Kestrel was ordered to hold, not confirmed yet.', 'Hold not confirmed'],
    [{ open: false, mode: 'GUIDED' }, 'Kestrel flies on in GUIDED.', 'Flies on: GUIDED'],
    [{ open: false, mode: '' }, 'It is not known what Kestrel is doing.', 'Flies on: '],
  ])('says what it does now: %j', (changes, title, badge) => {
    expect(read({ ...QUIET, ...changes })).toMatchObject({ title, said: title, badge, secondsLeft: null });
  });

  it('says what happens when its agent stops, unless it stays', () => {
    const after = (after_sticks: HoldView['after_sticks']): readonly string[] => read({ ...QUIET, after_sticks }).notes;
    expect(after('stays')).toEqual([]);
    expect(after('sinks')).toEqual(['If its agent stops, Kestrel sinks to the ground.']);
    expect(after('returns')).toEqual(['If its agent stops, the autopilot returns Kestrel.']);
    expect(after('unknown')[0]).toContain('not known');
  });

  it('is no good news that it would sink, holds its height alone, or is not confirmed', () => {
    expect(read(QUIET).tone).toBe('good');
    expect(read({ ...QUIET, after_sticks: 'sinks' }).tone).toBe('warning');
    expect(read({ ...QUIET, stage: 'altitude' }).tone).toBe('warning');
    expect(read({ ...QUIET, stage: 'none' }).tone).toBe('warning');
  });
});

describe('the countdown', () => {
  it('says why nobody flies it, first', () => {
    const reading = read({ nobody_because: 'anna released the controls' });
    expect(reading.notes[0]).toBe('Anna released the controls.');
    expect(reading.because).toBe('anna released the controls');
    expect(read({ ...QUIET, nobody_because: 'anna is away' }).notes).toEqual([]);
  });

  it('counts to the action by the clock of the tower', () => {
    expect(read()).toMatchObject({
      title: 'Kestrel returns in 24 s: nobody flies it.',
      notes: ['Kestrel holds: BRAKE, stays by itself.'],
      badge: 'Returns in 24 s',
      secondsLeft: 24,
      tone: 'warning',
      canStay: true,
    });
    expect(read({}, NOW_MS + 23_001).title).toBe('Kestrel returns in 1 s: nobody flies it.');
    expect(read({}, NOW_MS + 25_000)).toMatchObject({ title: 'Kestrel returns now: nobody flies it.', secondsLeft: 0 });
    // A tower whose clock is ten minutes behind ours.
    expect(read({}, NOW_MS + 600_000, { ...CONTEXT, towerLagMs: 600_000 }).secondsLeft).toBe(24);
    expect(read({ due_at: 'soon' })).toMatchObject({
      title: 'Kestrel returns soon: nobody flies it.',
      secondsLeft: null,
    });
  });

  it('is said to a listener at the bounds, and not each second', () => {
    const said = Array.from({ length: 25 }, (_, second) => read({}, NOW_MS + second * 1_000).said);
    expect([...new Set(said)]).toEqual([
      'Kestrel returns in less than 30 s: nobody flies it.',
      'Kestrel returns in less than 10 s: nobody flies it.',
    ]);
    expect(read({}, NOW_MS - 90_000).said).toBe('Kestrel returns in more than a minute: nobody flies it.');
  });

  it.each<[Partial<HoldView>, string]>([
    [{ action: 'land' }, 'Kestrel lands in 24 s: nobody flies it.'],
    [{ action: 'continue' }, 'Kestrel goes on with its mission in 24 s: nobody flies it.'],
    [{ action: null }, 'What Kestrel will do is not known: nobody flies it.'],
    [{ action: 'dance' as never }, 'What Kestrel will do is not known: nobody flies it.'],
    [{ lost: 'tower' }, 'Kestrel returns in 24 s: it has lost the tower.'],
  ])('names what comes: %j', (changes, title) => {
    expect(read(changes).title).toBe(title);
  });

  it('can be stopped for a lost person alone, and not by what the drone told before its link broke', () => {
    expect(read({ lost: 'tower' }).canStay).toBe(false);
    expect(read({ phase: 'stayed' }).canStay).toBe(false);
    expect(read({ action: 'stay' }).canStay).toBe(false);
    expect(read({ stale: true }).canStay).toBe(false);
  });
});

describe('the lost action', () => {
  const over = { due_at: null } as const;

  it('is told while it is asked for, and when it is done', () => {
    expect(read({ ...over, phase: 'asking' })).toMatchObject({
      title: 'Kestrel is told to return: nobody flew it for 30 s.',
      notes: ['Not confirmed by the autopilot yet.'],
    });
    const done = read({ ...over, phase: 'done', open: false, mode: 'RTL', stage: 'none' });
    expect(done).toMatchObject({ title: 'Kestrel returns: nobody flew it for 30 s.', badge: 'Returns, by itself' });
    expect(read({ ...over, phase: 'done', lost: 'tower', action: 'land', open: false }).title).toBe(
      'Kestrel lands: it had lost the tower for 30 s.',
    );
  });

  it('waits for the battery once somebody has said "stay"', () => {
    expect(read({ ...over, phase: 'stayed', detail: 'olga said so' })).toMatchObject({
      title: 'Kestrel stays for ten minutes, or until the battery is needed for the way home.',
      notes: ['Kestrel holds: BRAKE, stays by itself.', 'Olga said so.'],
      tone: 'good',
    });
    expect(read({ ...over, phase: 'stayed', open: false, mode: 'AUTO' }).title).toBe(
      'Kestrel flies on for ten minutes, or until the battery is needed for the way home.',
    );
  });
});

describe('what the agent told before its link broke', () => {
  it('says how old it is, and what should have come of it', () => {
    const before = read({ stale: true }, NOW_MS + 12_000);
    expect(before.title).toBe('Kestrel should return in 12 s: nobody flies it.');
    expect(before.notes[0]).toBe('From the last report of its agent, 12 s ago: its link is down.');
    expect(before.badge).toBe('Last report: should return in 12 s');
    const after = read({ stale: true }, NOW_MS + 600_000);
    expect(after.title).toBe('Kestrel should be returning now: nobody flies it.');
    expect(after.notes[0]).toContain('10 min ago');
    expect(read({ stale: true, phase: 'done', due_at: null, open: false }).title).toBe(
      'Kestrel was returning: nobody flew it for 30 s.',
    );
    expect(read({ stale: true, as_of: '' }).notes[0]).toBe('From the last report of its agent: its link is down.');
  });
});
