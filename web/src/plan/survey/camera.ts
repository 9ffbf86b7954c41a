/** The footprint of a camera that looks straight down, and the resulting distances of pictures and lines. */

import { t } from '../../languages/text';
import { SurveyFault } from './area';

export interface Camera {
  readonly sensorWidthMm: number;
  readonly sensorHeightMm: number;
  readonly focalMm: number;
  readonly widthPx: number;
  readonly heightPx: number;
  /** The longer side is across the line of flight. */
  readonly isAcross: boolean;
}

export interface Footprint {
  readonly acrossM: number;
  readonly alongM: number;
  /** Ground size of one pixel. */
  readonly pixelCm: number;
}

const isPositive = (value: number): boolean => Number.isFinite(value) && value > 0;

export function footprint(camera: Camera, heightM: number): Footprint {
  const { sensorWidthMm, sensorHeightMm, focalMm, widthPx, heightPx } = camera;
  if (![sensorWidthMm, sensorHeightMm, focalMm, widthPx, heightPx].every(isPositive)) {
    throw new SurveyFault(t("The camera's sensor, focal length and image size must be larger than 0."));
  }
  if (!isPositive(heightM)) throw new SurveyFault(t('The height above the ground must be above 0.'));
  const width = (sensorWidthMm / focalMm) * heightM;
  const height = (sensorHeightMm / focalMm) * heightM;
  const [long, short] = [Math.max(width, height), Math.min(width, height)];
  const pixelCm = (width / widthPx) * 100;
  return camera.isAcross ? { acrossM: long, alongM: short, pixelCm } : { acrossM: short, alongM: long, pixelCm };
}

export interface Distances {
  /** Between lines. */
  readonly spacingM: number;
  /** Between pictures on a line. */
  readonly triggerM: number;
}

/** Overlaps in per cent of a picture, 0 to 95. */
export function distancesFor(seen: Footprint, frontOverlap: number, sideOverlap: number): Distances {
  for (const overlap of [frontOverlap, sideOverlap]) {
    if (!(overlap >= 0 && overlap <= 95))
      throw new SurveyFault(t('An overlap of {overlap} % is outside of 0 to 95 %.', { overlap }));
  }
  return { spacingM: seen.acrossM * (1 - sideOverlap / 100), triggerM: seen.alongM * (1 - frontOverlap / 100) };
}
