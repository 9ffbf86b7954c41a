/** Recordings of a flight with a burnt-in flight display: the tower makes them on request. */

import { RestError, type Rest } from './rest';
import type { Schemas } from './rest_types';

export type DisplayVideo = Schemas['DisplayVideoView'];

const PATH = '/flights/{flight_id}/video/{recording_id}/display';

export const displayVideoHref = (flightId: number, recordingId: number): string =>
  `/api/v1/flights/${flightId}/video/${recordingId}/display/file`;

/** Begins to make it; the one that there is stays. Raises RestError. */
export const makeDisplayVideo = (rest: Rest, flightId: number, recordingId: number): Promise<DisplayVideo> =>
  rest.call('POST', PATH, { path: { flight_id: flightId, recording_id: recordingId } });

/** Null: nobody has asked for it, or its time is over. Raises RestError. */
export async function readDisplayVideo(
  rest: Rest,
  flightId: number,
  recordingId: number,
): Promise<DisplayVideo | null> {
  try {
    return await rest.call('GET', PATH, { path: { flight_id: flightId, recording_id: recordingId } });
  } catch (error) {
    if (error instanceof RestError && error.slug === 'flight-video-not-made') return null;
    throw error;
  }
}

export const isBeingMade = (video: DisplayVideo | null): boolean =>
  video?.state === 'waiting' || video?.state === 'making';
