/** Recordings of video in words. */

import { t } from '../languages/text';
import { towerText } from '../languages/tower_text';
import { mayRecord } from '../link/drone_view';
import type { Recording } from '../link/recordings';
import type { Drone, User } from '../link/wire_types';
import { dateTime } from './dates';
import { UNKNOWN } from './format';

const STATE_WORDS: Record<string, string> = {
  recording: t('Recording'),
  finishing: t('Being prepared'),
  ready: t('Ready'),
  failed: t('Failed'),
};

/** `0:07`, `1:02:03`. */
export function playTime(seconds: number | null): string {
  if (seconds === null) return UNKNOWN;
  const whole = Math.max(0, Math.round(seconds));
  const two = (value: number): string => String(value).padStart(2, '0');
  const hours = Math.floor(whole / 3600);
  const minutes = Math.floor((whole % 3600) / 60);
  return hours > 0 ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
}

/** How long it has been running, or the duration of the file. */
export function lengthWords({ state, began_at, duration_s }: Recording, nowMs: number): string {
  return state === 'recording' ? playTime((nowMs - Date.parse(began_at)) / 1000) : playTime(duration_s);
}

/** With the reason, if there is one. */
export function recordingState({ state, words }: Recording): string {
  const said = STATE_WORDS[state] ?? state;
  return words ? `${said}: ${towerText(words)}` : said;
}

/** The flights that it contains. */
export function flightWords({ flights }: Recording): string {
  const [first, ...more] = flights;
  if (first === undefined) return UNKNOWN;
  return more.length === 0
    ? dateTime(first)
    : t('{first} and {more} more', { first: dateTime(first), more: more.length });
}

/** Why this user may not start or stop a recording now; empty if they may. */
export function recordingBlocked(drone: Drone, user: User, isConnected: boolean): string {
  if (!isConnected) return t('The connection to the tower is down.');
  if (!drone.may_watch_video)
    return t('An admin has taken the video of {drone} with its controls.', { drone: drone.name });
  if (!mayRecord(drone, user))
    return t('Whoever has the controls of {drone}, or an admin, records its video.', { drone: drone.name });
  return '';
}

export const deleteQuestion = (droneName: string, recording: Recording) => ({
  title: t('Delete a recording of {droneName}?', { droneName }),
  text: t(
    'The recording of {droneName} that began on {beganAt} UTC ({playTime} long) is deleted from the tower for good.',
    { droneName, beganAt: dateTime(recording.began_at), playTime: playTime(recording.duration_s) },
  ),
  confirmLabel: t('Delete the recording'),
  isDanger: true,
});
