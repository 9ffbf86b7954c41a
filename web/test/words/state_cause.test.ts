import { describe, expect, it } from 'vitest';

import { stateCause } from '../../src/words/state_cause';
import { anAlert } from '../link/fakes';

const cause = (changes: Parameters<typeof anAlert>[0], batteryV: number | null = 13.34): string =>
  stateCause([anAlert({ rule: 'battery-low' }), anAlert(changes)], { batteryV });

describe('why a drone does what nobody commanded', () => {
  it.each([
    ['The autopilot of Osprey says: Battery Failsafe', 'Battery Failsafe, 13.3 V'],
    [
      'The autopilot of Osprey says: Battery 1 low voltage 13.30V used 812 mAh',
      'Battery 1 low voltage 13.30V used 812 mAh',
    ],
    ['The autopilot of Osprey: returns, because its battery is low.', 'returns, because its battery is low, 13.3 V'],
    ['The autopilot of Osprey says: EKF Failsafe: changed to LAND Mode', 'EKF Failsafe: changed to LAND Mode'],
  ])('%s', (words, expected) => {
    expect(cause({ rule: 'failsafe', words })).toBe(expected);
  });

  it('is no voltage that is not known', () => {
    expect(cause({ rule: 'failsafe', words: 'The autopilot of Osprey says: Battery Failsafe' }, null)).toBe(
      'Battery Failsafe',
    );
  });

  it('is a breach, in the words of its badge', () => {
    expect(cause({ rule: 'fence-breached', badge: 'Fence breached' })).toBe('Fence breached');
  });

  it('is nothing where only a command explains the mode', () => {
    expect(cause({ rule: 'battery-low' })).toBe('');
  });
});
