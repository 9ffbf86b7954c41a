import { beforeEach, describe, expect, it } from 'vitest';

import type { Sending } from '../../src/link/live';
import { CENTRED_MS, CENTRING_LIMIT_MS, Manual, manualControlFields } from '../../src/link/manual';
import { KeyboardSticks } from '../../src/link/keyboard_sticks';
import { CENTRED, type Axes, type AxesSource } from '../../src/link/sticks';
import { FakeClock } from './fakes';

let clock: FakeClock;
let hands: Axes | null;
let sending: Sending;
let sent: Axes[];
let holds: number;
let begun: number;
let manual: Manual;
const phase = (): string => manual.state.get().phase;
let source: AxesSource;
const start = (): void => manual.start(source, () => begun++);

beforeEach(() => {
  clock = new FakeClock();
  hands = CENTRED;
  source = { name: 'pad', read: () => hands };
  sending = 'sent';
  sent = [];
  holds = 0;
  begun = 0;
  manual = new Manual({
    clock,
    send(axes) {
      if (sending === 'sent') sent.push(axes);
      return sending;
    },
    hold: () => holds++,
  });
});

describe('flying by hand', () => {
  it('streams at 50 Hz', async () => {
    start();
    await clock.pass(CENTRED_MS);
    expect(phase()).toBe('flying');
    expect(begun).toBe(1);
    await clock.pass(1_000);
    expect(sent.length).toBeGreaterThanOrEqual(50);
    expect(sent.length).toBeLessThanOrEqual(51);
  });

  it('begins with centred sticks only', async () => {
    hands = { ...CENTRED, throttle: -1, yaw: 0.3 };
    start();
    await clock.pass(1_000);
    expect(sent).toEqual([]);
    expect(manual.state.get()).toMatchObject({ phase: 'centring', offCentre: ['throttle', 'yaw'] });
    hands = CENTRED;
    await clock.pass(CENTRED_MS - 40);
    hands = { ...CENTRED, yaw: -0.3 }; // it only passed through its middle
    await clock.pass(20);
    hands = CENTRED;
    await clock.pass(CENTRED_MS);
    expect(manual.state.get()).toMatchObject({ phase: 'centring', offCentre: [] });
    await clock.pass(20);
    expect(phase()).toBe('flying');
    expect(sent[0]).toEqual(CENTRED);
    hands = { ...CENTRED, throttle: -1 };
    await clock.pass(20);
    expect(sent.at(-1)).toEqual(hands);
  });

  it('gives up when nobody centres them, and needs no hold then', async () => {
    hands = { ...CENTRED, throttle: -1 };
    start();
    await clock.pass(CENTRING_LIMIT_MS + 1_000);
    expect(manual.state.get()).toMatchObject({ phase: 'off', ended: 'the sticks were not centred' });
    expect(holds).toBe(0);
    expect(clock.waiting).toBe(0);
  });

  it('does not jump when the clock of the computer is set', async () => {
    const keys = new KeyboardSticks();
    manual.start(keys);
    await clock.pass(CENTRED_MS + 20);
    keys.press('KeyW');
    await clock.pass(40);
    clock.set(3_600_000);
    await clock.pass(20);
    expect(sent.at(-1)?.throttle).toBeLessThan(0.2);
  });

  it('ends with a hold when the sticks cannot be read', async () => {
    start();
    await clock.pass(CENTRED_MS + 20);
    Object.defineProperty(source, 'read', {
      value: () => {
        throw new Error('no leave to see gamepads');
      },
    });
    await clock.pass(100);
    expect(phase()).toBe('off');
    expect(holds).toBe(1);
  });

  it('leaves out beats that cannot leave at once, and does not make up for them', async () => {
    start();
    await clock.pass(CENTRED_MS + 20);
    const before = sent.length;
    sending = 'skipped';
    await clock.pass(200);
    expect(sent.length).toBe(before);
    expect(manual.state.get().skipped).toBe(10);
    sending = 'sent';
    await clock.pass(100);
    expect(sent.length).toBe(before + 5);
    expect(phase()).toBe('flying');
  });

  it('ends with a hold when the pilot stops or the pad is pulled', async () => {
    start();
    await clock.pass(CENTRED_MS + 20);
    manual.stop('the page was hidden', { holds: true });
    expect(holds).toBe(1);
    expect(manual.state.get().ended).toBe('the page was hidden');
    manual.stop('again', { holds: true });
    expect(holds).toBe(1);

    start();
    await clock.pass(CENTRED_MS + 20);
    const count = sent.length;
    hands = null;
    await clock.pass(100);
    expect(holds).toBe(2);
    expect(manual.state.get()).toMatchObject({ phase: 'off', ended: 'pad is gone' });
    expect(sent.length).toBe(count);
    expect(clock.waiting).toBe(0);
  });

  it('ends without one when the connection or the controls are gone: nothing of ours would pass', async () => {
    start();
    await clock.pass(CENTRED_MS + 20);
    sending = 'down';
    await clock.pass(20);
    expect(phase()).toBe('off');
    start();
    sending = 'sent';
    await clock.pass(CENTRED_MS + 40);
    manual.stop('taken', { holds: false });
    expect(holds).toBe(0);
  });
});

describe('MANUAL_CONTROL', () => {
  it('is exact at the centre and at the ends', () => {
    expect(manualControlFields(CENTRED, 7)).toEqual({ target: 7, x: 0, y: 0, z: 500, r: 0 });
    const ends = { pitch: 1, roll: -1, yaw: 2, throttle: -1 };
    expect(manualControlFields(ends, 7)).toEqual({ target: 7, x: 1000, y: -1000, z: 0, r: 1000 });
    expect(manualControlFields({ ...CENTRED, throttle: 1 }, 7).z).toBe(1000);
  });
});
