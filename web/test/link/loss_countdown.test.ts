import { describe, expect, it } from 'vitest';

import { countdown, type Silence } from '../../src/link/loss_countdown';
import type { LostAction } from '../../src/link/wire_types';

const SILENCE: Silence = { whose: 'drone', sinceMs: 10_000, isAirborne: true, lostAction: 'return', lostActionS: 30 };
const text = (silence: Partial<Silence>, nowMs: number): string | undefined =>
  countdown('Heron', { ...SILENCE, ...silence }, nowMs)?.text;

describe('the countdown of a lost link', () => {
  it('counts from the loss to the configured action', () => {
    expect(text({}, 10_000)).toBe('Heron holds. If the link does not come back it will return in 30 s.');
    expect(text({}, 39_001)).toBe('Heron holds. If the link does not come back it will return in 1 s.');
    expect(text({}, 40_000)).toBe('Heron should now be returning.');
    expect(text({}, 500_000)).toBe('Heron should now be returning.');
  });

  it.each<[LostAction, string, string]>([
    ['land', 'will land in', 'be landing'],
    ['continue', 'will go on with its mission in', 'be going on with its mission'],
    ['nothing', 'will do what its autopilot is set to in', 'be doing what its autopilot is set to'],
    ['tomorrow' as LostAction, 'will do what its autopilot is set to in', 'be doing what its autopilot is set to'],
  ])('names the action %s', (lostAction, before, after) => {
    expect(text({ lostAction }, 12_000)).toContain(before);
    expect(text({ lostAction }, 50_000)).toContain(after);
  });

  it('does not claim to know more than this page can', () => {
    expect(text({ whose: 'own' }, 12_000)).toContain('If the tower is lost to it as well');
    expect(text({ whose: 'own' }, 50_000)).toContain('otherwise it holds');
  });

  it('never begins above its own length, whatever the clock of the page says', () => {
    const early = countdown('Heron', SILENCE, 9_400);
    expect(early?.secondsLeft).toBe(30);
  });

  it('is not for a drone on the ground', () => {
    expect(text({ isAirborne: false }, 12_000)).toBeUndefined();
  });
});
