/** The video of a drone in words: what is wrong and who is affected, and the figures of the picture. */

import { t } from '../languages/text';
import { towerText } from '../languages/tower_text';
import type { Drone } from '../link/wire_types';
import type { QualityName, VideoStats, VideoStatus } from '../video/video_types';
import { clockTime, fixed, UNKNOWN } from './format';

/** A picture older than this is not what the drone sees now. */
export const LATE_MS = 500;
/** Without a new picture for this long, the picture counts as old. */
export const STILL_MS = 1_000;

export const QUALITY_WORDS: Record<QualityName, string> = { low: t('Low'), medium: t('Medium'), high: t('High') };

export interface VideoSays {
  readonly title: string;
  readonly detail: string;
  /** Whether it needs attention: something expected is missing. */
  readonly isFault: boolean;
}

const says = (title: string, detail = '', isFault = true): VideoSays => ({ title, detail, isFault });

/** Null while the picture is live and self-explanatory. */
export function videoWords(
  drone: string,
  status: VideoStatus,
  stats: VideoStats | null,
  nowMs: number,
): VideoSays | null {
  const words = status.words === `${drone} is offline.` ? '' : towerText(status.words);
  const since = clockTime(status.sinceMs);
  switch (status.state) {
    case 'live':
      if (!stats || stats.stillMs === null)
        return says(t('Waiting for the first picture of {drone}…', { drone }), '', false);
      return isStill(stats)
        ? says(
            t('No new picture of {drone} for {still} s.', { drone, still: fixed(stats.stillMs / 1000) }),
            t('What is shown is old.'),
          )
        : null;
    case 'connecting':
      return says(t('Opening the video of {drone}…', { drone }), '', false);
    case 'waiting':
      return says(t('Waiting for the first picture of {drone}…', { drone }), '', false);
    case 'no-camera':
      return says(t('{drone} has no camera that its agent offers.', { drone }), words, false);
    case 'camera-lost':
      return says(
        t('Camera of {drone} lost since {since} UTC.', { drone, since }),
        words || t('Its agent keeps trying to open it.'),
      );
    case 'offline':
      return says(t('{drone} is offline.', { drone }), words, false);
    case 'thin-link':
      return says(t('The link of {drone} is too thin for video.', { drone }), words || t('A lower quality may pass.'));
    case 'no-agent-video':
      return says(
        t('The video of {drone} does not reach the tower.', { drone }),
        words || t('Its agent says that there is a camera, and sends no pictures.'),
      );
    case 'cut-off': {
      const seconds = status.retryAtMs === null ? 0 : Math.max(0, Math.ceil((status.retryAtMs - nowMs) / 1000));
      return says(
        t('The connection to the tower is lost: no video of {drone}.', { drone }),
        seconds > 0 ? t('Next try in {seconds} s.', { seconds }) : t('Trying now.'),
      );
    }
    case 'refused':
      return says(t('The tower gives no video of {drone}.', { drone }), words);
    case 'paused':
      return says(t('The video of {drone} is paused.', { drone }), t('It goes on when it is in sight.'), false);
    case 'unplayable':
      return says(t('This browser cannot show the video of {drone}.', { drone }), words);
  }
}

/** For a user whom an admin also locked out of the video, with TAKE. */
export const videoTaken = (drone: Pick<Drone, 'name' | 'holder'>): VideoSays =>
  says(
    t('The video of {drone} was taken too.', { drone: drone.name }),
    t('{holder} took control without letting you watch the video. It comes back with them.', {
      holder: drone.holder?.name ?? t('An admin'),
    }),
  );

/** No new picture for so long that the visible one is not what the drone sees. */
export const isStill = (stats: VideoStats | null): boolean =>
  stats !== null && stats.stillMs !== null && stats.stillMs > STILL_MS;

export const isLate = (stats: VideoStats | null): boolean => isStill(stats) || (stats?.delayMs ?? 0) > LATE_MS;

/**
 * The age of the visible picture. The clock offset is an estimate: the computed age of a fresh picture may be negative.
 */
export function delayWords(stats: VideoStats): string {
  const { stillMs, delayMs } = stats;
  if (stillMs === null) return UNKNOWN;
  if (isStill(stats)) return t('{still} s old', { still: fixed(stillMs / 1000, 1) });
  return delayMs === null ? t('delay {unknown}', { unknown: UNKNOWN }) : `${fixed(Math.max(0, delayMs))} ms`;
}

export const rateWords = (bitsPerS: number): string =>
  bitsPerS < 1_000_000 ? `${fixed(bitsPerS / 1000)} kbit/s` : `${fixed(bitsPerS / 1_000_000, 1)} Mbit/s`;

/** Pictures that were not shown, and why: lost on the way, or skipped because this browser was slow. */
export function missedWords({ lost, skipped }: VideoStats): string {
  return skipped > 0 ? t('lost {lost}, skipped {skipped}', { lost, skipped }) : t('lost {lost}', { lost });
}

/** The name of a saved picture: sorts by time, and states the clock. */
export const snapshotWords = (drone: string, atMs: number): string =>
  `${drone} ${new Date(atMs).toISOString().slice(0, 19).replace(/:/g, '-')}Z`;
