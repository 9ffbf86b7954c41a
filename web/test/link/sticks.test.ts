import { describe, expect, it } from 'vitest';

import { KeyboardSticks } from '../../src/link/keyboard_sticks';
import { CENTRED, findPad, offCentre, padAxes, padSource, type PadLike } from '../../src/link/sticks';

const pad = (axes: number[], more: Partial<PadLike> = {}): PadLike => ({
  id: 'P',
  index: 1,
  connected: true,
  axes,
  ...more,
});

describe('a pad', () => {
  it('is read as mode 2, up and forward positive', () => {
    expect(padAxes(pad([0.1, -0.2, 0.3, -0.4]))).toEqual({ yaw: 0.1, throttle: 0.2, roll: 0.3, pitch: 0.4 });
    expect(padAxes(pad([0, 0, 3, NaN]))).toEqual({ yaw: 0, throttle: 0, roll: 1, pitch: 0 });
  });

  it('needs two sticks and a plug', () => {
    expect(findPad(() => [null, pad([0, 0]), pad([0, 0, 0, 0], { connected: false })])).toBeNull();
    const good = pad([0, 0, 0, 0]);
    expect(findPad(() => [null, good])).toBe(good);
  });

  it('rests a little off its middle, and that counts as centred', () => {
    let pads: (PadLike | null)[] = [pad([0.05, -0.06, 0, 0.5])];
    const source = padSource(pads[0]!, () => pads);
    expect(source.read(0)).toEqual({ ...CENTRED, pitch: -0.5 });
    expect(offCentre({ ...CENTRED, yaw: -0.07 })).toEqual([]);
    expect(offCentre({ ...CENTRED, yaw: -0.2, roll: 1 })).toEqual(['yaw', 'roll']);
    pads = [pad([0, 0, 0, 0], { id: 'another' })];
    expect(source.read(0)).toBeNull();
    pads = [];
    expect(source.read(0)).toBeNull();
  });
});

describe('keys', () => {
  it('move the sticks with ramps, and let them spring back', () => {
    const keys = new KeyboardSticks();
    expect(keys.read(0)).toEqual(CENTRED);
    expect(keys.press('KeyW')).toBe(true);
    expect(keys.press('ArrowLeft')).toBe(true);
    const partly = keys.read(100);
    expect(partly.throttle).toBeCloseTo(0.2);
    expect(partly.roll).toBeCloseTo(-0.2);
    expect(keys.read(5_000)).toEqual({ ...CENTRED, throttle: 1, roll: -1 });
    keys.release('KeyW');
    expect(keys.read(5_100).throttle).toBeCloseTo(0.5);
    expect(keys.read(5_300)).toEqual({ ...CENTRED, roll: -1 });
  });

  it('that oppose each other cancel out', () => {
    const keys = new KeyboardSticks();
    keys.read(0);
    keys.press('ArrowUp');
    keys.press('ArrowDown');
    expect(keys.read(1_000)).toEqual(CENTRED);
  });

  it('are all up when the page says so', () => {
    const keys = new KeyboardSticks();
    keys.read(0);
    keys.press('KeyD');
    expect(keys.read(1_000).yaw).toBe(1);
    keys.releaseAll();
    expect(keys.read(1_020)).toEqual(CENTRED);
  });

  it('of other uses are left alone', () => {
    expect(new KeyboardSticks().press('Escape')).toBe(false);
  });
});
