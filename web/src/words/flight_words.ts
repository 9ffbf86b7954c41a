/** Recorded flights in words. */

import { t } from '../languages/text';
import type { ImportedFlight } from '../link/flight_imports';
import type { Flight } from '../link/flights';
import { bytes } from './dates';
import { UNKNOWN } from './format';
import { playTime } from './recording_words';

/** From arming to disarming; how long it has been so far while it goes on. */
export function flightLength({ state, began_at, duration_s }: Flight, nowMs: number): string {
  return playTime(state === 'recording' ? (nowMs - Date.parse(began_at)) / 1000 : duration_s);
}

export function pilotWords({ pilots }: Flight): string {
  return pilots.length === 0 ? UNKNOWN : pilots.map(({ name }) => name).join(', ');
}

/** What is to be said of a flight beside its figures; empty for one that is recorded from arming to disarming. */
export function flightNote({ state, words, lost_frames }: Flight): string {
  if (state === 'recording') return t('Is being recorded');
  const lost = lost_frames > 0 ? t('{lostFrames} frames are missing', { lostFrames: lost_frames }) : '';
  const noted = [state === 'failed' ? words || t('Cannot be read') : words, lost].filter(Boolean).join('; ');
  return noted === '' ? '' : noted[0]!.toUpperCase() + noted.slice(1);
}

const FORMATS: Readonly<Record<ImportedFlight['format'], string>> = {
  tlog: t('Telemetry log'),
  dataflash: t('Dataflash log of ArduPilot'),
  ulog: t('ULog of PX4'),
};

/** Of which kind the file was, and what is to be known of it. */
export function importNote({ format, clock_known, clock_jumps, skipped_bytes }: ImportedFlight): string {
  const parts = [
    FORMATS[format],
    clock_known ? '' : t('no time of day: it begins at the import'),
    (clock_jumps?.length ?? 0) > 0
      ? t("its computer's clock was set in between: times are those of the autopilot")
      : '',
    skipped_bytes > 0 ? t('{skippedBytes} could not be read', { skippedBytes: bytes(skipped_bytes) }) : '',
  ];
  return parts.filter(Boolean).join('; ');
}
