/** The properties of a video. */

import type { CodecChoice, QualityName } from './video_types';

export interface VideoProps {
  droneId: number;
  droneName: string;
  /** Bindable: the viewer may choose another one. */
  quality?: QualityName;
  codec?: CodecChoice;
  /** Whether there are buttons: quality, snapshot, full screen. */
  controls?: boolean;
  /** Whether to show all figures over the picture, or only its age. */
  figures?: boolean;
}
