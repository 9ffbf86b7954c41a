import { beforeEach, describe, expect, it } from 'vitest';

import { mayAcknowledge } from '../../src/link/alert_rights';
import {
  ALERT_LIMIT,
  alertCounts,
  Alerts,
  byUrgency,
  folded,
  needsSomebody,
  OWN_ID,
  worstOpen,
  type Alert,
} from '../../src/link/alerts';
import { aloneWords, ALONE_AFTER_MS } from '../../src/link/page_alone';
import { A_DRONE, anAlert, FakeClock, settled } from './fakes';

const OVER = '2026-01-01T12:05:00Z';
const lost = anAlert({ id: 2, rule: 'link-lost', severity: 'critical', rank: 0, opened_at: '2026-01-01T12:01:00Z' });

let clock: FakeClock;
let alerts: Alerts;
let past: Alert[];
let asked: number[];
const ids = (): number[] => alerts.list.get().map(({ id }) => id);

beforeEach(() => {
  clock = new FakeClock();
  past = [];
  asked = [];
  alerts = new Alerts(clock, {
    pastAlerts: () => Promise.resolve(past as never),
    acknowledgeAlert: (id) => {
      asked.push(id);
      if (id === 404) return Promise.reject(new Error('there is no such alert'));
      return Promise.resolve({ ...anAlert({ id }), acknowledged_at: OVER } as never);
    },
  });
});

describe('the list', () => {
  it('has each alert once, as the tower last said it, oldest first', () => {
    alerts.take(lost);
    alerts.take(anAlert());
    alerts.take(anAlert({ closed_at: OVER }));
    expect(ids()).toEqual([1, 2]);
    expect(alerts.list.get()[0]).toMatchObject({ closed_at: OVER });
  });

  it('forgets on a new connection what the tower no longer tells, and reads the past again', async () => {
    alerts.take(anAlert());
    alerts.take(anAlert({ id: 3, closed_at: OVER }));
    past = [anAlert({ id: 4, closed_at: OVER }), anAlert({ id: 5 }), { ...lost, closed_at: OVER }];
    alerts.welcome([lost]);
    expect(ids()).toEqual([3, 2]);
    await settled();
    expect(ids(), '5 was open in an older answer only').toEqual([4, 3, 2]);
    expect(
      alerts.of(1).map(({ id }) => id),
      'what is known is newer',
    ).toEqual([2]);
  });

  it('forgets those of a drone that is no longer ours to see, and of pairs with it', () => {
    alerts.take(anAlert({ drone_id: 1, other_id: 2 }));
    alerts.take(anAlert({ id: 3, drone_id: 2 }));
    alerts.take(anAlert({ id: 4, drone_id: 5 }));
    alerts.gone(2);
    expect(ids()).toEqual([4]);
  });

  it('is bounded, and keeps what lasts', () => {
    alerts.take(anAlert({ id: 9_999, opened_at: '2025-01-01T00:00:00Z' }));
    for (let id = 0; id < ALERT_LIMIT + 20; id++) alerts.take(anAlert({ id, closed_at: OVER }));
    expect(alerts.list.get()).toHaveLength(ALERT_LIMIT);
    expect(ids()).toContain(9_999);
  });
});

describe('the alerts of a drone', () => {
  it('are those that last, the most urgent first, of a pair for both', () => {
    alerts.take(anAlert({ rank: 9 }));
    alerts.take(lost);
    alerts.take(anAlert({ id: 3, closed_at: OVER, rank: 1 }));
    alerts.take(anAlert({ id: 4, rank: 11, other_id: 7 }));
    expect(alerts.of(1).map(({ id }) => id)).toEqual([2, 1, 4]);
    expect(alerts.of(7).map(({ id }) => id)).toEqual([4]);
    expect(alerts.of(8)).toEqual([]);
  });
});

describe('who has to look', () => {
  it.each<[string, Partial<Alert>, boolean]>([
    ['open', {}, true],
    ['a notice', { severity: 'notice' }, false],
    ['open and acknowledged', { acknowledged_at: OVER }, false],
    ['a warning that is over', { closed_at: OVER }, false],
    ['a critical one that is over', { severity: 'critical', closed_at: OVER }, true],
    ['the same, acknowledged', { severity: 'critical', closed_at: OVER, acknowledged_at: OVER }, false],
  ])('%s: %#', (_, changes, expected) => {
    expect(needsSomebody(anAlert(changes))).toBe(expected);
  });

  it('comes first among what lasts; what is over comes after all that lasts', () => {
    const all = [
      anAlert({ id: 1, closed_at: OVER }),
      anAlert({ id: 2, acknowledged_at: OVER, severity: 'critical' }),
      anAlert({ id: 3 }),
      anAlert({ id: 4, severity: 'critical', closed_at: OVER }),
      anAlert({ id: 5, rank: 2 }),
    ];
    expect(byUrgency(all).map(({ id }) => id)).toEqual([5, 3, 2, 4, 1]);
    expect(worstOpen(all), 'what is over makes no noise').toBe('warning');
    expect(worstOpen([...all, lost])).toBe('critical');
    expect(worstOpen(all.slice(0, 2))).toBeNull();
  });

  it('has a drone of their own in trouble: before others, however bad that is', () => {
    const all = [
      lost,
      anAlert({ id: 3, drone_id: 7, rule: 'battery-low', rank: 14 }),
      anAlert({ id: 4, drone_id: 5, other_id: 7, rule: 'near', rank: 17 }),
      anAlert({ id: 5, drone_id: 7, severity: 'critical', closed_at: OVER }),
    ];
    expect(byUrgency(all, new Set([7])).map(({ id }) => id)).toEqual([3, 4, 2, 5]);
    expect(byUrgency(all).map(({ id }) => id)[0]).toBe(2);
  });

  it('sees what can still be changed before what cannot', () => {
    const all = [
      anAlert({ id: 1, rule: 'crashed', severity: 'critical', rank: 4 }),
      anAlert({ id: 2, rule: 'battery-critical', severity: 'critical', rank: 9 }),
      anAlert({ id: 3, rule: 'battery-low', rank: 14 }),
    ];
    expect(byUrgency(all).map(({ id }) => id)).toEqual([2, 1, 3]);
  });
});

describe('repeats', () => {
  const at = (minute: number): string => `2026-01-01T12:0${minute}:00Z`;
  const again = [
    anAlert({ id: 1, rule: 'battery-low', opened_at: at(0), closed_at: at(1) }),
    anAlert({ id: 2, rule: 'battery-low', opened_at: at(2), closed_at: at(3) }),
    anAlert({ id: 3, rule: 'battery-low', opened_at: at(4) }),
    anAlert({ id: 4, rule: 'battery-low', opened_at: at(4), drone_id: 9 }),
    anAlert({ id: 5, rule: 'failsafe', words: 'The autopilot of A says: Battery 13.3 V', opened_at: at(0) }),
    anAlert({ id: 6, rule: 'failsafe', words: 'The autopilot of A says: Battery 13.1 V', opened_at: at(1) }),
    anAlert({ id: 7, rule: 'failsafe', words: 'The autopilot of A says: Radio Failsafe', opened_at: at(2) }),
  ];

  it('are one line, where the most urgent of them stood', () => {
    expect(folded(byUrgency(again)).map(({ alert, all }) => [alert.id, all.length])).toEqual([
      [3, 3],
      [4, 1],
      [7, 1],
      [6, 2],
    ]);
  });

  it('count once, apart for what is now and what is to be read', () => {
    expect(alertCounts(again)).toEqual({ now: 4, toRead: 0 });
    const over = [1, 2].map((id) => anAlert({ id, rule: 'crashed', severity: 'critical', closed_at: OVER }));
    expect(alertCounts([...again, ...over])).toEqual({ now: 4, toRead: 1 });
    expect(alertCounts(over.map((one) => ({ ...one, acknowledged_at: OVER })))).toEqual({ now: 0, toRead: 0 });
  });
});

describe('who may see to it', () => {
  it.each([
    ['operator', 'owner', true],
    ['operator', 'borrower', true],
    ['operator', 'observer', false],
    ['observer', 'observer', false],
    ['admin', 'admin', true],
  ] as const)('may acknowledge: %s, %s', (role, relation, expected) => {
    expect(mayAcknowledge(anAlert(), { relation }, { role })).toBe(expected);
    expect(mayAcknowledge(anAlert(), undefined, { role })).toBe(false);
    expect(mayAcknowledge({ drone_id: null }, undefined, { role })).toBe(true);
  });
});

describe('an acknowledgement', () => {
  it('goes to the tower, whose answer counts', async () => {
    alerts.take(lost);
    await alerts.acknowledge(lost);
    expect(asked).toEqual([2]);
    expect(alerts.list.get()[0]!.acknowledged_at).toBe(OVER);
  });

  it('of several goes on when one is gone', async () => {
    await alerts.acknowledgeAll([anAlert({ id: 404 }), lost]);
    expect(asked).toEqual([404, 2]);
    await expect(alerts.acknowledge(anAlert({ id: 404 }))).rejects.toThrow('no such alert');
  });
});

describe("the page's own alert", () => {
  const own = { words: 'This page has lost the tower.', severity: 'warning' } as const;

  it('lasts until the tower is heard, and is acknowledged here alone', async () => {
    alerts.own(own);
    await clock.pass(2_000);
    alerts.own(own);
    const [first] = alerts.list.get();
    expect(first).toMatchObject({
      id: OWN_ID,
      drone_id: null,
      opened_at: new Date(clock.nowMs() - 2_000).toISOString(),
    });
    await alerts.acknowledge(first!);
    expect(asked).toEqual([]);
    alerts.own(own);
    expect(alerts.list.get().filter(needsSomebody)).toEqual([]);
    alerts.own(null);
    expect(ids()).toEqual([]);
  });

  it('is critical for whoever controls a drone in the air', () => {
    const flown = { ...A_DRONE, name: 'Heron', airborne: true, holder: { id: 5, name: 'olga' } };
    const said = (drones: (typeof flown)[], now = ALONE_AFTER_MS) => aloneWords(0, drones, { id: 5 }, now);
    expect(said([flown])).toMatchObject({ severity: 'critical', words: expect.stringContaining('You control Heron.') });
    expect(said([{ ...flown, airborne: false }])?.severity).toBe('warning');
    expect(said([])?.severity).toBe('warning');
    expect(said([flown], ALONE_AFTER_MS - 1)).toBeNull();
    expect(aloneWords(null, [flown], { id: 5 }, 9_999)).toBeNull();
    expect(aloneWords(0, [flown], null, 9_999)).toBeNull();
  });
});
