import { beforeEach, describe, expect, it } from 'vitest';

import { AssistTurns, REFUSAL_BELIEVED_MS, waitsFor } from '../../src/link/assist_turns';
import type { Drone } from '../../src/link/wire_types';
import { A_DRONE, FakeClock } from './fakes';

const OLGA = { id: 5, name: 'olga' };
const BOSS = { id: 1, name: 'boss' };
const ASSISTED: Drone = { ...A_DRONE, holder: OLGA, assistant: BOSS };

let clock: FakeClock;
let assist: AssistTurns;
const waiting = (drone = ASSISTED, user = OLGA) => waitsFor(drone, assist.turns.get().get(drone.id), user);

beforeEach(() => {
  clock = new FakeClock();
  assist = new AssistTurns(clock);
});

describe('whose commands pass', () => {
  it('is what the tower says', () => {
    expect(waiting()).toBeNull();
    assist.turn(1, BOSS);
    expect(waiting()).toEqual(BOSS);
    expect(waiting(ASSISTED, BOSS)).toBeNull();
    assist.turn(1, OLGA);
    expect(waiting()).toBeNull();
  });

  it('is also told by a refusal, for a while', async () => {
    assist.refused(ASSISTED);
    expect(waiting()).toEqual(BOSS);
    await clock.pass(REFUSAL_BELIEVED_MS - 100);
    assist.refused(ASSISTED);
    await clock.pass(REFUSAL_BELIEVED_MS - 100);
    expect(waiting()).toEqual(BOSS);
    await clock.pass(200);
    expect(waiting()).toBeNull();
  });

  it('keeps to the word of the tower where there is one', async () => {
    assist.turn(1, BOSS);
    assist.refused(ASSISTED);
    await clock.pass(60_000);
    expect(waiting()).toEqual(BOSS);
  });

  it('is nobody’s question once the assistance has ended', () => {
    assist.turn(1, BOSS);
    assist.drone({ ...ASSISTED, assistant: null });
    expect(assist.turns.get().size).toBe(0);
    assist.refused({ ...ASSISTED, assistant: null });
    expect(assist.turns.get().size).toBe(0);
    expect(clock.waiting).toBe(0);
  });
});
