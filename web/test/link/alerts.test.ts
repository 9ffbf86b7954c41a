import { beforeEach, describe, expect, it } from 'vitest';

import { ALERT_LIMIT, Alerts, byUrgency, REPEAT_MS, worstOpen } from '../../src/link/alerts';

let alerts: Alerts;
const texts = (): string[] => alerts.list.get().map(({ text }) => text);
const low = { id: 'battery-low', severity: 'warning', text: 'Battery low' } as const;
const lost = { id: 'link-lost', severity: 'critical', text: 'Link lost' } as const;

beforeEach(() => (alerts = new Alerts()));

describe('a condition', () => {
  it('is one alert for as long as it lasts, and a new one when it begins again', () => {
    alerts.holds(1, [low], 0);
    alerts.holds(1, [low], 1_000);
    expect(alerts.list.get()).toMatchObject([{ text: 'Battery low', isLasting: true, beganMs: 0 }]);
    alerts.holds(1, [], 2_000);
    expect(alerts.list.get()).toMatchObject([{ isLasting: false, acknowledgedMs: null }]);
    alerts.holds(1, [low], 3_000);
    expect(alerts.list.get()).toHaveLength(2);
  });

  it('of one drone is not that of another', () => {
    alerts.holds(1, [low], 0);
    alerts.holds(12, [], 0);
    alerts.holds(12, [low], 0);
    alerts.holds(1, [], 0);
    expect(alerts.list.get()).toMatchObject([
      { droneId: 1, isLasting: false },
      { droneId: 12, isLasting: true },
    ]);
  });

  it('that was acknowledged is not said again while it lasts', () => {
    alerts.holds(1, [lost], 0);
    alerts.acknowledge(alerts.list.get()[0]!.key, 500);
    alerts.holds(1, [lost], 1_000);
    expect(worstOpen(alerts.list.get())).toBeNull();
  });
});

describe('a statement', () => {
  it('that is repeated is counted, until it was acknowledged or long ago', () => {
    alerts.said(1, 'warning', 'PreArm: no', 0);
    alerts.said(1, 'warning', 'PreArm: no', 10_000);
    alerts.said(2, 'warning', 'PreArm: no', 10_000);
    expect(alerts.list.get().map(({ droneId, count }) => [droneId, count])).toEqual([
      [1, 2],
      [2, 1],
    ]);
    alerts.acknowledgeAll(11_000);
    alerts.said(1, 'warning', 'PreArm: no', 12_000);
    expect(alerts.list.get()).toHaveLength(3);
    alerts.said(1, 'warning', 'PreArm: no', 12_000 + REPEAT_MS);
    expect(alerts.list.get()).toHaveLength(4);
  });
});

describe('the list', () => {
  it('has what is open first, the worst first, the newest first', () => {
    alerts.said(1, 'warning', 'a', 1);
    alerts.said(1, 'critical', 'b', 2);
    alerts.said(1, 'warning', 'c', 3);
    alerts.said(1, 'critical', 'done', 4);
    alerts.acknowledge(alerts.list.get().at(-1)!.key, 5);
    expect(byUrgency(alerts.list.get()).map(({ text }) => text)).toEqual(['b', 'c', 'a', 'done']);
    expect(worstOpen(alerts.list.get())).toBe('critical');
  });

  it('is bounded, and keeps what is critical and open longest', () => {
    alerts.said(1, 'critical', 'first', 0);
    for (let at = 0; at < 2 * ALERT_LIMIT; at++) alerts.said(1, 'warning', `w${at}`, at);
    expect(alerts.list.get()).toHaveLength(ALERT_LIMIT);
    expect(texts()[0]).toBe('first');
    expect(texts().at(-1)).toBe(`w${2 * ALERT_LIMIT - 1}`);
  });
});
