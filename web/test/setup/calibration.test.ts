import { expect, test } from 'vitest';

import type { MessageName } from '../../src/link/generated/mavlink.gen';
import type { Message } from '../../src/link/mavlink';
import { begun, isCompassDone, NO_CALIBRATION, received, type CalibrationView } from '../../src/setup/calibration';

const message = (name: MessageName, fields: object): Message =>
  ({ name, header: { compid: 1, sysid: 1 }, fields }) as unknown as Message;
const pose = (param1: number): Message => message('COMMAND_LONG', { command: 42429, param1 });
const progress = (compass_id: number, completion_pct: number): Message =>
  message('MAG_CAL_PROGRESS', { compass_id, completion_pct, cal_status: 2 });
const report = (compass_id: number, cal_status: number): Message =>
  message('MAG_CAL_REPORT', { compass_id, cal_status, fitness: 4.2 });
const after = (view: CalibrationView, ...messages: readonly Message[]): CalibrationView =>
  messages.reduce(received, view);

test('the positions come from the autopilot', () => {
  const asked = after(begun('accelerometer'), pose(1), pose(1), pose(2));
  expect([asked.pose, asked.poseWords]).toEqual([2, 'on its left side']);
  expect(after(asked, pose(16_777_215))).toMatchObject({ pose: null, outcome: 'done' });
  expect(after(asked, pose(16_777_216))).toMatchObject({ pose: null, outcome: 'failed' });
});

test('a page that opens meanwhile joins it, and old ends are no news', () => {
  expect(after(NO_CALIBRATION, pose(3))).toMatchObject({ sensor: 'accelerometer', pose: 3 });
  expect(after(NO_CALIBRATION, pose(16_777_216))).toBe(NO_CALIBRATION);
  expect(after(NO_CALIBRATION, progress(0, 10)).sensor).toBe('compass');
  expect(after(NO_CALIBRATION, message('STATUSTEXT', { text: 'x' }))).toBe(NO_CALIBRATION);
});

test('each compass has a bar, and all must be done to keep them', () => {
  const running = after(begun('compass'), progress(1, 40), progress(0, 35), progress(1, 45));
  expect(running.compasses.map(({ id, percent }) => [id, percent])).toEqual([
    [0, 35],
    [1, 45],
  ]);
  expect(isCompassDone(running)).toBe(false);
  const half = after(running, report(0, 4));
  expect(isCompassDone(half)).toBe(false);
  const all = after(half, report(1, 10));
  expect(isCompassDone(all)).toBe(true);
  expect(all.compasses[1]).toMatchObject({ isGood: false, words: 'failed: the field changes, as near metal' });
});

test('texts are kept, the newest few', () => {
  const texts = [...Array(9).keys()].map((at) => message('STATUSTEXT', { text: `[cal] ${at}` }));
  expect(after(begun('gyroscope'), ...texts).texts.at(-1)).toBe('[cal] 8');
  expect(after(begun('gyroscope'), ...texts).texts).toHaveLength(6);
});
