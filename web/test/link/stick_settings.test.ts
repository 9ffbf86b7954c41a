import { beforeEach, describe, expect, it } from 'vitest';

import {
  DEFAULT_PAD,
  DEFAULT_SETTINGS,
  MAX_PADS,
  readDocument,
  SETTINGS_VERSION,
  toDocument,
  UnreadableSettings,
  withPad,
  type StickSettings,
} from '../../src/link/stick_settings';
import { StickSettingsStore } from '../../src/link/stick_settings_store';
import { FakeClock, settled } from './fakes';
import { pad } from './pads';

const USED = withPad({ ...DEFAULT_SETTINGS, mode: 1 }, pad([0, 0, 0, 0], { id: 'Some pad' }), {
  ...DEFAULT_PAD,
  buttons: { 3: 'hold' },
});
const onTheWire = (settings: StickSettings): Record<string, unknown> =>
  JSON.parse(JSON.stringify(toDocument(settings))) as Record<string, unknown>;

describe('the document', () => {
  it('comes back as it was', () => {
    expect(readDocument(onTheWire(USED))).toEqual(USED);
    expect(readDocument(undefined)).toEqual(DEFAULT_SETTINGS);
  });

  const pads = onTheWire(USED)['pads'] as Record<string, { slots: Record<string, object> }>;
  const broken = (slot: object): object => ({
    pads: { P: { ...Object.values(pads)[0], slots: { ...Object.values(pads)[0]!.slots, leftX: slot } } },
  });
  it.each<[string, object]>([
    ['a newer version', { version: SETTINGS_VERSION + 1 }],
    ['no version', { version: null }],
    ['no such mode', { mode: 5 }],
    ['a mode in words', { mode: '2' }],
    ['no pads', { pads: [] }],
    ['half a pad', { pads: { P: { slots: {} } } }],
    ['half an axis', broken({ axis: 0.5, isInverted: false, low: -1, centre: 0, high: 1 })],
    ['travel that is none', broken({ axis: 0, isInverted: false, low: 0, centre: 0, high: 0 })],
    ['travel without end', broken({ axis: 0, isInverted: false, low: -1, centre: 0, high: 1e9 })],
    ['no direction', broken({ axis: 0, low: -1, centre: 0, high: 1 })],
  ])('is refused with %s', (_, changes) => {
    expect(() => readDocument({ ...onTheWire(USED), ...changes })).toThrow(UnreadableSettings);
  });

  it('keeps the pads used last, and stays well below what the tower keeps', () => {
    let settings = DEFAULT_SETTINGS;
    const buttons = Object.fromEntries([...Array(17).keys()].map((number) => [number, 'disarm' as const]));
    const awkward = { axis: 12, isInverted: true, low: -0.9137254953384399, centre: 0.003921568859368563, high: 1 };
    const slots = { leftX: awkward, leftY: awkward, rightX: awkward, rightY: awkward };
    for (const number of [1, 2, 3, 4, 5, 6, 7, 1]) {
      const id = `Xbox Wireless Controller ${number} (STANDARD GAMEPAD Vendor: 045e Product: 0b13)`;
      settings = withPad(settings, pad([0, 0, 0, 0], { id }), {
        ...DEFAULT_PAD,
        slots,
        buttons,
      });
    }
    const ids = Object.keys(settings.pads).map((id) => id.split(' ')[3]);
    expect(ids).toEqual(['3', '4', '5', '6', '7', '1']);
    expect(ids.length).toBe(MAX_PADS);
    expect(JSON.stringify(toDocument(settings)).length).toBeLessThan(8 * 1024);
  });
});

describe('the store', () => {
  let clock: FakeClock;
  let stored: Record<string, unknown>;
  let puts: number;
  let fault: Error | null;
  let store: StickSettingsStore;

  beforeEach(() => {
    clock = new FakeClock();
    stored = {};
    puts = 0;
    fault = null;
    const answer = <T>(value: T): Promise<T> => (fault ? Promise.reject(fault) : Promise.resolve(value));
    store = new StickSettingsStore(clock, {
      preferences: () => answer(stored),
      keepPreference(name, document) {
        puts++;
        if (!fault) stored = { ...stored, [name]: JSON.parse(JSON.stringify(document)) as unknown };
        return answer(undefined);
      },
    });
  });

  it('reads what the tower has', async () => {
    stored = { sticks: onTheWire(USED), other: {} };
    await store.read();
    expect(store.kept.get()).toMatchObject({ settings: USED, phase: 'kept', isRead: true });
  });

  it('sends one change after the other, and the newest last', async () => {
    const sent: unknown[] = [];
    const arrived: (() => void)[] = [];
    store = new StickSettingsStore(clock, {
      preferences: () => Promise.resolve({}),
      keepPreference(_, document) {
        sent.push((document as { mode: unknown }).mode);
        return new Promise((resolve) => arrived.push(() => resolve(undefined)));
      },
    });
    for (const mode of [1, 3, 4] as const) {
      store.change((settings) => ({ ...settings, mode }));
      await clock.pass(1_000);
    }
    expect([sent, store.kept.get().phase]).toEqual([[1], 'saving']);
    arrived[0]!();
    await settled();
    expect([sent, store.kept.get().phase]).toEqual([[1, 4], 'saving']);
    arrived[1]!();
    await settled();
    expect(store.kept.get().phase).toBe('kept');
  });

  it('says why it could not, and does not pass off guesses as the pilot’s', async () => {
    fault = new Error('The tower cannot be reached.');
    await store.read();
    expect(store.kept.get()).toMatchObject({ phase: 'failed', why: 'The tower cannot be reached.', isRead: false });
    fault = null;
    stored = { sticks: { version: 99 } };
    await store.read();
    expect(store.kept.get()).toMatchObject({ phase: 'failed', isRead: false });
    store.startAnew();
    await clock.pass(1_000);
    expect(stored['sticks']).toEqual(onTheWire(DEFAULT_SETTINGS));
    expect(store.kept.get()).toMatchObject({ phase: 'kept', isRead: true });
  });

  it('keeps many changes at once, and says when it could not', async () => {
    await store.read();
    for (const mode of [1, 3, 4] as const) store.change((settings) => ({ ...settings, mode }));
    expect(store.kept.get()).toMatchObject({ phase: 'saving', settings: { mode: 4 } });
    await clock.pass(1_000);
    expect(puts).toBe(1);
    expect(stored['sticks']).toMatchObject({ mode: 4 });
    fault = new Error('no room');
    store.change((settings) => ({ ...settings, mode: 2 }));
    await clock.pass(1_000);
    expect(store.kept.get()).toMatchObject({ phase: 'failed', why: 'no room', settings: { mode: 2 }, isRead: true });
  });

  it('does not give one user the answer to another', async () => {
    stored = { sticks: onTheWire(USED) };
    const reading = store.read();
    store.forget();
    await reading;
    await settled();
    expect(store.kept.get()).toMatchObject({ phase: 'unread', isRead: false, settings: DEFAULT_SETTINGS });
  });
});
