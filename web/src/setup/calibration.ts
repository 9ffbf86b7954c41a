/**
 * Follows a calibration by what the autopilot itself says: the positions that it asks for, the progress of each
 * compass, its texts. Pure.
 */

import { ACCELCAL_POSITIONS, MAG_CAL_STATES, MAG_CAL_SUCCESS } from './calibration_words';
import { MAV_CMD } from '../link/generated/mavlink.gen';
import type { Message } from '../link/mavlink';

export type Sensor = 'accelerometer' | 'level' | 'gyroscope' | 'compass' | 'barometer';

const SUCCEEDED = 16_777_215;
const FAILED = 16_777_216;
const MAX_TEXTS = 6;

export interface CompassView {
  readonly id: number;
  readonly percent: number;
  readonly words: string;
  readonly isOver: boolean;
  readonly isGood: boolean;
  /** The error that is left, as it reports it; null: not yet. */
  readonly fitness: number | null;
}

export interface CalibrationView {
  /** What was started here; null: nothing. */
  readonly sensor: Sensor | null;
  /** The position that the autopilot asks for, from 1; null: none. */
  readonly pose: number | null;
  readonly poseWords: string;
  /** How the accelerometer's ended; null: not yet. */
  readonly outcome: 'done' | 'failed' | null;
  readonly compasses: readonly CompassView[];
  /** The newest last. */
  readonly texts: readonly string[];
}

export const NO_CALIBRATION: CalibrationView = {
  sensor: null,
  pose: null,
  poseWords: '',
  outcome: null,
  compasses: [],
  texts: [],
};

export const begun = (sensor: Sensor): CalibrationView => ({ ...NO_CALIBRATION, sensor });

/** Whether every compass that reported is done, and there is something to keep. */
export const isCompassDone = ({ compasses }: CalibrationView): boolean =>
  compasses.length > 0 && compasses.every(({ isOver }) => isOver);

/** The view after one message of the autopilot. */
export function received(view: CalibrationView, message: Message): CalibrationView {
  switch (message.name) {
    case 'COMMAND_LONG':
      return message.fields.command === MAV_CMD.ACCELCAL_VEHICLE_POS ? posed(view, message.fields.param1) : view;
    case 'MAG_CAL_PROGRESS': {
      const { compass_id: id, completion_pct: percent, cal_status: status } = message.fields;
      const words = MAG_CAL_STATES[status] ?? '';
      return withCompass(view, { id, percent, words, isOver: false, isGood: false, fitness: null });
    }
    case 'MAG_CAL_REPORT': {
      const { compass_id: id, cal_status: status, fitness } = message.fields;
      const isGood = status === MAG_CAL_SUCCESS;
      const words = MAG_CAL_STATES[status] ?? '';
      return withCompass(view, { id, percent: isGood ? 100 : 0, words, isOver: true, isGood, fitness });
    }
    case 'STATUSTEXT':
      // Without a calibration here they are the page's messages.
      return view.sensor === null ? view : { ...view, texts: [...view.texts, message.fields.text].slice(-MAX_TEXTS) };
    default:
      return view;
  }
}

function posed(view: CalibrationView, position: number): CalibrationView {
  const sensor = view.sensor ?? 'accelerometer';
  if (position === SUCCEEDED || position === FAILED) {
    // Repeated until the next calibration: what ended before this page is no news.
    if (view.sensor === null) return view;
    return { ...view, sensor, pose: null, poseWords: '', outcome: position === SUCCEEDED ? 'done' : 'failed' };
  }
  const poseWords = ACCELCAL_POSITIONS[position];
  return poseWords === undefined ? view : { ...view, sensor, pose: position, poseWords, outcome: null };
}

function withCompass(view: CalibrationView, compass: CompassView): CalibrationView {
  const others = view.compasses.filter(({ id }) => id !== compass.id);
  const compasses = [...others, compass].sort((one, other) => one.id - other.id);
  return { ...view, sensor: view.sensor ?? 'compass', compasses };
}
