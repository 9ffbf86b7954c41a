/** What the parts of the video player say to one another, and to the page (docs/video.md). No code that runs. */

export type QualityName = 'low' | 'medium' | 'high';
export type CodecName = 'mpeg1' | 'h264';
/** `auto`: H.264 where both the drone's agent and this browser have it, else MPEG-1. */
export type CodecChoice = 'auto' | CodecName;

/** How it is with the drone's video, as the tower says it (server/live/video/situation.py). */
export const TOWER_STATES = [
  'waiting',
  'live',
  'no-camera',
  'camera-lost',
  'offline',
  'thin-link',
  'no-agent-video',
] as const;
export type TowerState = (typeof TOWER_STATES)[number];

/**
 * The same as a viewer has it. Ours: `connecting` (no word of the tower yet), `cut-off` (the connection to the tower is
 * down and is tried again), `refused` (the tower does not give it to us), `paused` (nobody looks), `unplayable` (this
 * browser cannot show it).
 */
export type VideoState = TowerState | 'connecting' | 'cut-off' | 'refused' | 'paused' | 'unplayable';

export interface VideoStatus {
  readonly state: VideoState;
  /** For people: what is wrong; empty where nothing is, or where `state` says it all. */
  readonly words: string;
  /** What the drone's agent can send; empty until the tower has said. */
  readonly codecs: readonly CodecName[];
  /** What is asked for now. */
  readonly quality: QualityName;
  readonly codec: CodecName;
  /** When it came to be so, by the computer's clock. */
  readonly sinceMs: number;
  /** When the connection is tried again, by the computer's clock; null where none is planned. */
  readonly retryAtMs: number | null;
}

/** Of the last moments, told twice a second. Null: not known. */
export interface VideoStats {
  /** From the camera to the screen, of the pictures drawn since the last report, else of the last: the middle one, and
   * the worst. */
  readonly delayMs: number | null;
  readonly worstDelayMs: number | null;
  /** How long nothing new was drawn. Null before the first picture. */
  readonly stillMs: number | null;
  /** Pictures drawn a second. */
  readonly rateHz: number;
  readonly bitsPerS: number;
  /** Pictures since the view began that never came, and those that the tower left out because we were too slow. */
  readonly lost: number;
  readonly skipped: number;
  /** What decoding one picture takes. */
  readonly decodeMs: number | null;
  /** Of the picture in sight, in pixels; 0 before there is one. */
  readonly width: number;
  readonly height: number;
}

export type ToPlayer =
  | {
      readonly type: 'open';
      readonly canvas: OffscreenCanvas;
      /** Of the page: a worker's own address is that of its script. */
      readonly page: { readonly protocol: string; readonly host: string };
      readonly droneId: number;
      readonly quality: QualityName;
      readonly codec: CodecChoice;
    }
  | { readonly type: 'want'; readonly quality: QualityName; readonly codec: CodecChoice }
  | { readonly type: 'watch'; readonly isWatched: boolean }
  | { readonly type: 'snapshot'; readonly key: number }
  | { readonly type: 'stop' };

export type FromPlayer =
  | { readonly type: 'status'; readonly status: VideoStatus }
  | { readonly type: 'stats'; readonly stats: VideoStats }
  | { readonly type: 'snapshot'; readonly key: number; readonly picture: Blob | null };
