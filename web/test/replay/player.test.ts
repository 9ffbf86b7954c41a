import { describe, expect, it } from 'vitest';
import fc from 'fast-check';

import { FlightReader } from '../../src/replay/flight_reader';
import { Player } from '../../src/replay/player';
import { recordedDrone } from '../../src/replay/recorded_drone';
import { Vehicle } from '../../src/link/vehicle';
import { splitTagged, tag } from '../../src/link/tagged_frames';
import { aFlight, BEGAN_MS } from '../frames/recorded';
import { FakeClock, settled } from '../link/fakes';
import { examples } from '../examples';

const DRONE = recordedDrone(7, 'Heron');
const SECONDS = 120;
const bytes = aFlight(SECONDS);

function opened(pieceBytes = bytes.length): { reader: FlightReader; player: Player } {
  const reader = new FlightReader();
  const player = new Player({ piece: (number) => Promise.resolve(reader.piece(number)) }, DRONE);
  const tell = (): void => {
    const { fromMs, toMs, begins, overview } = reader.progress(bytes.length);
    player.known(fromMs, toMs, begins, overview.airborneMs);
  };
  for (let at = 0; at < bytes.length; at += pieceBytes) {
    reader.take(bytes.subarray(at, at + pieceBytes));
    tell();
  }
  reader.end();
  tell();
  return { reader, player };
}

const height = (player: Player): number | null => {
  const { vehicle, atMs } = player.state.get();
  return vehicle.values(atMs).altRelM;
};

describe('a replay', () => {
  it('shows any moment as the live console would have shown it', async () => {
    const { player } = opened();
    await settled();
    await fc.assert(
      fc.asyncProperty(fc.integer({ min: 0, max: SECONDS * 1000 - 100 }), async (ms) => {
        player.seek(BEGAN_MS + ms);
        await settled();
        const live = liveAt(BEGAN_MS + ms);
        const { vehicle, atMs } = player.state.get();
        // Both count from the first frame that the live console has seen.
        const since = { airborneMs: null, batteryTime: null };
        expect({ ...vehicle.values(atMs), ...since }).toEqual({ ...live.values(atMs), ...since });
      }),
      { numRuns: examples(15, 60) },
    );
  });

  it('adds up steps that follow each other before they are shown', async () => {
    const { player } = opened();
    await settled();
    player.seek(-Infinity);
    for (let step = 0; step < 4; step++) player.seek(player.headedMs + 10_000);
    expect(player.state.get()).toMatchObject({ atMs: BEGAN_MS, isSeeking: true });
    await settled();
    expect(player.state.get()).toMatchObject({ atMs: BEGAN_MS + 40_000, isSeeking: false });
    player.seek(Infinity);
    player.seek(player.headedMs - 10_000);
    await settled();
    expect(player.state.get().atMs).toBe(player.toMs - 10_000);
  });

  it('stays as it was beyond its end, while a longer flight beside it goes on', async () => {
    const { player } = opened();
    await settled();
    player.widen(BEGAN_MS - 5_000, BEGAN_MS + (SECONDS + 60) * 1000);
    player.seek(Infinity);
    await settled();
    const { atMs, vehicle } = player.state.get();
    expect(atMs).toBe(BEGAN_MS + (SECONDS + 60) * 1000);
    expect(player.vehicleMs).toBe(player.toMs);
    const atEnd = vehicle.values(player.vehicleMs);
    player.seek(player.toMs);
    await settled();
    expect(player.state.get().vehicle.values(player.toMs).altRelM).toBe(atEnd.altRelM);
    player.seek(-Infinity);
    expect(player.state.get().atMs).toBe(BEGAN_MS - 5_000);
    player.play();
    player.pass(200);
    expect(player.state.get().atMs).toBe(BEGAN_MS - 4_800);
    expect(player.vehicleMs).toBe(player.fromMs);
  });

  it('plays at its speed, pauses at the end, and begins again', async () => {
    const { player } = opened();
    await settled();
    player.setSpeed(16);
    player.play();
    for (let frame = 0; frame < 50; frame++) {
      player.pass(20);
      await settled();
    }
    expect(player.state.get().atMs).toBeCloseTo(BEGAN_MS + 16_000, 3);
    expect(height(player)).toBe(16);
    player.seek(BEGAN_MS + (SECONDS - 1) * 1000);
    await settled();
    player.pass(200);
    await settled();
    expect(player.state.get()).toMatchObject({ isPlaying: false, atMs: player.toMs });
    player.play();
    await settled();
    expect(player.state.get()).toMatchObject({ isPlaying: true, atMs: BEGAN_MS });
  });

  it('keeps the same vehicle while it plays on, over pieces, and another one after a jump back', async () => {
    const { player } = opened();
    await settled();
    const { vehicle } = player.state.get();
    player.seek(BEGAN_MS + 3_000);
    await settled();
    player.seek(BEGAN_MS + 5_000);
    await settled();
    expect(player.state.get().vehicle).toBe(vehicle);
    expect(height(player)).toBe(5);
    player.seek(BEGAN_MS + 2_000);
    await settled();
    expect(player.state.get().vehicle).not.toBe(vehicle);
    expect(height(player)).toBe(2);
  });

  it('waits for what is not fetched yet, and shows it then', async () => {
    const reader = new FlightReader();
    const player = new Player({ piece: (number) => Promise.resolve(reader.piece(number)) }, DRONE);
    player.seek(BEGAN_MS + 5_000);
    reader.take(bytes.subarray(0, 2_000));
    const tell = (): void => {
      const { fromMs, toMs, begins, overview } = reader.progress(bytes.length);
      player.known(fromMs, toMs, begins, overview.airborneMs);
    };
    tell();
    await settled();
    reader.take(bytes.subarray(2_000));
    reader.end();
    tell();
    await settled();
    player.seek(BEGAN_MS + 5_000);
    await settled();
    expect(height(player)).toBe(5);
  });

  it('is the same whether the flight came in one piece or in many', async () => {
    const { player } = opened(10_000);
    await settled();
    player.seek(BEGAN_MS + 77_700);
    await settled();
    expect(height(player)).toBeCloseTo(77.7);
  });

  it('shows the sticks as they passed, and none when they rest', async () => {
    const { player } = opened();
    await settled();
    player.seek(BEGAN_MS + 2_500);
    await settled();
    expect(player.sticks).toEqual({ pitch: 0.5, roll: -1, throttle: 0.5, yaw: 0 });
    player.seek(BEGAN_MS + 9_000);
    await settled();
    expect(player.sticks).toBeNull();
  });
});

/** What a console shows that heard the flight live. */
function liveAt(untilMs: number): Vehicle {
  const clock = new FakeClock();
  const vehicle = new Vehicle(
    DRONE,
    clock,
    { command: () => new Promise(() => undefined), send: () => true, sendFresh: () => 'sent', alerts: () => [] },
    () => undefined,
  );
  let at = 0;
  const view = new DataView(bytes.buffer);
  while (at < bytes.length) {
    const atMs = Number(view.getBigUint64(at)) / 1000;
    if (atMs > untilMs) break;
    const length = 12 + bytes[at + 9]!;
    const [one] = splitTagged(tag(7, bytes.subarray(at + 8, at + 8 + length)))!;
    vehicle.receive(one!.frame, atMs);
    at += 8 + length;
  }
  return vehicle;
}

describe('the overview', () => {
  it('has the way, the modes and what the autopilot said', () => {
    const { reader } = opened();
    const { track, modes, texts, airborneMs } = reader.progress(bytes.length).overview;
    expect(track[0]).toEqual({ atMs: BEGAN_MS, latDeg: 47, lonDeg: 8, altRelM: 0 });
    expect(track.at(-1)).toMatchObject({ atMs: BEGAN_MS + SECONDS * 1000 - 100 });
    expect(modes.map(({ atMs, customMode }) => [atMs, customMode])).toEqual([
      [BEGAN_MS, 4],
      [BEGAN_MS + SECONDS * 500, 6],
    ]);
    expect(texts).toEqual([{ atMs: BEGAN_MS + 1_500, severity: 4, text: 'EKF variance' }]);
    expect(airborneMs).toBe(BEGAN_MS + 1_600);
  });
});
