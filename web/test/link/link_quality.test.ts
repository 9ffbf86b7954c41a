import { describe, expect, it } from 'vitest';

import { readLink } from '../../src/link/link_quality';

const over = (rtt_ms: number, loss: number) => ({ rtt_ms, jitter_ms: 3, loss_up: loss, loss_down: 0 });

describe('the quality of a link', () => {
  it('is read from a tower that says everything', () => {
    const quality = readLink({
      drone_id: 1,
      rtt_ms: 60,
      loss: 0,
      over_1s: over(62, 0),
      over_30s: over(61, 0.015),
      path_mtu: 1452,
      transport: 'udp',
      uplinks: 2,
    });
    expect(quality).toEqual({
      grade: 'good',
      over1s: { rttMs: 62, jitterMs: 3, lossUpPercent: 0, lossDownPercent: 0 },
      over30s: { rttMs: 61, jitterMs: 3, lossUpPercent: 1.5, lossDownPercent: 0 },
      pathMtuBytes: 1452,
      transport: 'udp',
      uplinks: 2,
    });
  });

  it('is made whole from one that says little', () => {
    const quality = readLink({ drone_id: 1, rtt_ms: null, loss: 0 });
    expect(quality.over30s.jitterMs).toBeNull();
    expect([quality.transport, quality.grade]).toEqual([null, 'good']);
  });

  it.each([
    [100, 0, 'good'],
    [100, 0.05, 'fair'],
    [250, 0, 'fair'],
    [450, 0, 'poor'],
    [100, 0.15, 'poor'],
    [600, 0, 'bad'],
    [100, 0.5, 'bad'],
  ] as const)('with %d ms and a loss of %d is %s', (rttMs, loss, grade) => {
    const event = { drone_id: 1, rtt_ms: rttMs, loss: 0, over_1s: over(rttMs, 0) } as const;
    expect(readLink({ ...event, over_30s: over(rttMs, loss) }).grade).toBe(grade);
  });
});
