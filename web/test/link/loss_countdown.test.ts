import { describe, expect, it } from 'vitest';

import { countdown, type Silence } from '../../src/link/loss_countdown';
import type { LostAction } from '../../src/link/wire_types';
import { A_HOLD } from './fakes';

const SILENCE: Silence = {
  whose: 'drone',
  sinceMs: 10_000,
  isAirborne: true,
  mode: 'AUTO',
  task: 'mission',
  hold: null,
  lostAction: 'return',
  lostActionS: 30,
  towerLagMs: 0,
};
const at = (silence: Partial<Silence>, nowMs: number) => countdown('Heron', { ...SILENCE, ...silence }, nowMs);
const text = (silence: Partial<Silence>, nowMs = 29_000): string | undefined => at(silence, nowMs)?.text;

const ALIVE = '(if its agent is alive)';

describe('the words of a lost link', () => {
  it('say what it did last, and what its agent does about it, if there is one', () => {
    expect(text({})).toBe(
      `Heron was flying its mission; it goes on with it until its agent returns it in about 11 s ${ALIVE}.`,
    );
    expect(text({}, 40_000)).toBe(`Heron was flying its mission; it should be returning now ${ALIVE}.`);
    expect(text({}, 500_000)).toBe(text({}, 40_000));
  });

  it.each<[string, Partial<Silence>, string]>([
    [
      'by hand',
      { task: 'by-hand', mode: 'LOITER' },
      `Heron was flown by hand (LOITER); it holds, and its agent will return it in about 11 s ${ALIVE}.`,
    ],
    [
      'by itself',
      { task: 'by-itself', mode: 'GUIDED' },
      `Heron was in GUIDED; its agent will return it in about 11 s ${ALIVE}.`,
    ],
    ['on its way home', { task: 'return', mode: 'RTL' }, 'Heron was returning; it should go on with that.'],
    ['landing', { task: 'landing', mode: 'LAND' }, 'Heron was landing; it should go on with that.'],
    [
      'never heard',
      { task: null, mode: null },
      `It is not known what Heron was doing; its agent will return it in about 11 s ${ALIVE}.`,
    ],
    [
      'who knows where',
      { isAirborne: null },
      `It is not known whether Heron is in the air. Heron was flying its mission; it goes on with it until its agent returns it in about 11 s ${ALIVE}.`,
    ],
    ['set to go on', { lostAction: 'continue' }, 'Heron was flying its mission; it should go on with that.'],
    [
      'set to stay',
      { lostAction: 'stay', task: 'by-hand', mode: 'LOITER' },
      `Heron was flown by hand (LOITER); it holds, and its agent returns it when the battery is needed for the way home ${ALIVE}.`,
    ],
    ['watched only', { lostAction: 'none' }, 'Heron was flying its mission; what comes next is up to its autopilot.'],
    [
      'set to what a newer tower knows',
      { lostAction: 'tomorrow' as LostAction },
      'Heron was flying its mission; this page does not know what its agent will do.',
    ],
  ])('are true of one that was %s', (_, silence, expected) => {
    expect(text(silence)).toBe(expected);
  });

  it('go by the hold and the lost action that its agent told last', () => {
    const hold = { ...A_HOLD, stale: true, due_at: new Date(33_000).toISOString() };
    const by = { task: 'by-itself', mode: 'BRAKE' } as const;
    expect(text({ ...by, hold })).toBe(`Heron held in BRAKE; its agent will return it in about 4 s ${ALIVE}.`);
    expect(text({ ...by, hold: { ...hold, action: 'land' } })).toContain('will land it in about 4 s');
    expect(text({ ...by, hold: { ...hold, stage: 'altitude' } })).toContain('held its height only');
    // "Stay" applies to the lost person: it does not apply to a lost tower.
    expect(text({ ...by, hold: { ...hold, phase: 'stayed', due_at: null } })).toContain('will return it in about 11 s');
    expect(text({ hold: { ...hold, phase: 'done', open: false, due_at: null } })).toBe(
      'Heron was returning; it should go on with that.',
    );
  });

  it('do not claim to know more than a page that is deaf itself can', () => {
    expect(text({ whose: 'own' })).toBe(
      `At the last contact, Heron was flying its mission. If it has lost the tower too, it goes on with it until its agent returns it in about 11 s ${ALIVE}.`,
    );
    expect(text({ whose: 'own' }, 50_000)).toContain('If it has lost the tower too, it should be returning now');
  });

  it('count nothing where nothing is counted', () => {
    expect(at({}, 29_000)?.secondsLeft).toBe(11);
    expect(at({ lostAction: 'stay' }, 29_000)?.secondsLeft).toBeNull();
    expect(at({ task: 'return' }, 29_000)?.secondsLeft).toBeNull();
  });

  it('never begin above their own length, whatever the clock of the page says', () => {
    expect(at({}, 9_400)?.secondsLeft).toBe(30);
  });

  it('are not for a drone on the ground', () => {
    expect(text({ isAirborne: false })).toBeUndefined();
  });
});
