/** What a page gives to a video. */

import type { CodecChoice, QualityName } from './video_types';

export interface VideoProps {
  droneId: number;
  droneName: string;
  /** Can be bound: the viewer may choose another one. */
  quality?: QualityName;
  codec?: CodecChoice;
  /** Whether there are buttons: quality, snapshot, full screen. */
  controls?: boolean;
  /** Whether all figures are shown over the picture, or its age alone. */
  figures?: boolean;
}
