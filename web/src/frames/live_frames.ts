/** The frames of one drone over the last ten minutes, for charts and the inspector. */

import type { Vehicle } from '../link/vehicle';
import { FrameLog } from './frame_log';

export const KEPT_MS = 600_000;
/** Ten minutes with 400 frames of 50 bytes a second. */
const MAX_BYTES = 16 * 1024 * 1024;

/** Keeps them from now on, until the returned function is called. A frame costs its copy, and is not decoded. */
export function keepFrames(vehicle: Vehicle): { readonly log: FrameLog; readonly stop: () => void } {
  const log = new FrameLog({ maxMs: KEPT_MS, maxBytes: MAX_BYTES });
  return { log, stop: vehicle.onFrame((frame, nowMs) => log.push(nowMs, frame, 0, frame.length)) };
}
