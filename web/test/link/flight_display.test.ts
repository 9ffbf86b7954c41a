import { describe, expect, it } from 'vitest';

import { AttitudeMotion, OLD_AFTER_MS, type AttitudeSample } from '../../src/link/attitude_motion';
import { BatteryMeter } from '../../src/link/battery_time';
import { estimatorHealth } from '../../src/link/estimator_health';

const LEVEL: AttitudeSample = { atMs: 0, roll: 0, pitch: 0, yaw: 0, rollspeed: 0, pitchspeed: 0, yawspeed: 0 };
const SMOOTH = { smooth: true };

describe('attitude between two messages', () => {
  it('goes on with its rates for a moment, then waits, then is not known', () => {
    const motion = new AttitudeMotion();
    const rolling = { ...LEVEL, rollspeed: 1 };
    expect(motion.at(rolling, 0, SMOOTH)?.rollDeg).toBe(0);
    let last = 0;
    for (let nowMs = 16; nowMs <= 150; nowMs += 16) {
      const { rollDeg } = motion.at(rolling, nowMs, SMOOTH)!;
      expect(rollDeg).toBeGreaterThan(last);
      last = rollDeg;
    }
    expect(motion.at(rolling, 1_500, SMOOTH)?.rollDeg).toBeCloseTo(8.59, 1); // only 150 ms of it
    expect(motion.at(rolling, OLD_AFTER_MS + 1, SMOOTH)).toBeNull();
    expect(motion.at(null, 0, SMOOTH)).toBeNull();
  });

  it('turns the short way over north', () => {
    const motion = new AttitudeMotion();
    const at = (yawDeg: number, nowMs: number): number =>
      motion.at({ ...LEVEL, atMs: nowMs, yaw: (yawDeg * Math.PI) / 180 }, nowMs, SMOOTH)!.headingDeg;
    expect(at(-2, 0)).toBeCloseTo(358);
    const between = at(2, 50);
    expect(between > 358 || between < 2).toBe(true);
    expect(at(2, 5_000)).toBeCloseTo(2);
  });

  it('does not guess for those who want less motion, nor with the nose straight up', () => {
    const motion = new AttitudeMotion();
    expect(motion.at({ ...LEVEL, rollspeed: 1 }, 100, { smooth: false })?.rollDeg).toBe(0);
    const steep = { ...LEVEL, pitch: 1.57, yawspeed: 2, pitchspeed: 2, roll: 1 };
    expect(new AttitudeMotion().at(steep, 100, SMOOTH)?.pitchDeg).toBeCloseTo(89.95, 1);
  });
});

describe('how long the battery lasts', () => {
  const flying = (): BatteryMeter => {
    const meter = new BatteryMeter();
    meter.inAir(true);
    return meter;
  };
  /** Falls by one each ten seconds, from `percent`, for this long. */
  function drain(meter: BatteryMeter, percent: number, fromMs: number, forMs: number): void {
    for (let ms = 0; ms <= forMs; ms += 1000) meter.percentage(percent - Math.floor(ms / 10_000), fromMs + ms);
  }

  it('is what the autopilot says in flight, counted down', () => {
    const meter = flying();
    meter.said(600, 0);
    expect(meter.left(60_000)).toEqual({ leftMs: 540_000, isEstimate: false });
    meter.said(0, 61_000);
    expect(meter.left(61_000)).toBeNull();
  });

  it('is not known on the ground, whatever the autopilot makes of the idle current', () => {
    const meter = new BatteryMeter();
    meter.said(36_000, 0);
    drain(meter, 90, 0, 300_000);
    expect(meter.left(300_000)).toBeNull();
    meter.inAir(true);
    expect(meter.left(300_000)).toEqual({ leftMs: 35_700_000, isEstimate: false });
    meter.inAir(false);
    expect(meter.left(300_000)).toBeNull();
  });

  it('is estimated from how it goes down, once there are minutes to go by', () => {
    const meter = flying();
    drain(meter, 90, 0, 120_000);
    expect(meter.left(120_000)).toBeNull(); // 89 % at 10 s, 78 % at 120 s: not two minutes
    drain(meter, 77, 130_000, 0);
    expect(meter.left(130_000)).toEqual({ leftMs: 770_000, isEstimate: true });
    expect(meter.left(135_000)?.leftMs).toBe(765_000);
    expect(meter.left(170_000)).toBeNull(); // it has stopped falling
  });

  it('goes by what was drawn lately', () => {
    const meter = flying();
    drain(meter, 90, 0, 300_000); // 60 % after five minutes
    for (let ms = 0; ms <= 300_000; ms += 1000) meter.percentage(60 - Math.floor(ms / 30_000), 300_000 + ms);
    // 50 % now, at 30 s each.
    expect(meter.left(600_000)!.leftMs).toBeCloseTo(1_500_000, -5);
  });

  it('is not guessed at over a change of battery, nor from the flight before', () => {
    const meter = flying();
    drain(meter, 90, 0, 200_000);
    expect(meter.left(200_000)).not.toBeNull();
    meter.percentage(100, 201_000);
    expect(meter.left(201_000)).toBeNull();
    drain(meter, 100, 201_000, 200_000);
    expect(meter.left(401_000)).not.toBeNull();
    meter.inAir(false);
    meter.inAir(true);
    expect(meter.left(402_000)).toBeNull();
  });
});

describe('what the estimator is worth', () => {
  const report = {
    velocity_variance: 0.1,
    pos_horiz_variance: 0.1,
    pos_vert_variance: 0.1,
    compass_variance: 0.1,
    terrain_alt_variance: 0,
    airspeed_variance: 0,
    flags: 0x033f,
  };
  it.each([
    [{}, 'good', 'good'],
    [{ flags: 0 }, 'danger', 'no attitude'],
    [{ flags: 0x00a7 }, 'warning', 'no position'],
    [{ compass_variance: 0.6 }, 'warning', 'doubtful compass'],
    [{ pos_horiz_variance: 0.9, compass_variance: 0.6 }, 'danger', 'bad position'],
  ])('%o', (changes, tone, text) => {
    expect(estimatorHealth({ ...report, ...changes }, undefined)).toEqual({ tone, text });
  });
});
