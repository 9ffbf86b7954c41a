/**
 * Messages between the parts of the video player, and to the page (docs/video.md). Types only, apart from constants.
 */

export type QualityName = 'low' | 'medium' | 'high';
export type CodecName = 'mpeg1' | 'h264';
/** `auto`: H.264 if both the drone's agent and this browser support it, else MPEG-1. */
export type CodecChoice = 'auto' | CodecName;

/** The state of the drone's video, as the tower reports it (server/video/core/situation.py). */
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
 * The state for a viewer. Adds `connecting` (no message from the tower yet), `cut-off` (the connection to the tower is
 * down and is retried), `refused` (the tower denies access), `paused` (not visible), `unplayable` (this browser cannot
 * show it).
 */
export type VideoState = TowerState | 'connecting' | 'cut-off' | 'refused' | 'paused' | 'unplayable';

export interface VideoStatus {
  readonly state: VideoState;
  /** The problem, for people; empty if there is none, or if `state` says it all. */
  readonly words: string;
  /** What the drone's agent can send; empty until the tower has reported it. */
  readonly codecs: readonly CodecName[];
  /** What is requested now. */
  readonly quality: QualityName;
  readonly codec: CodecName;
  /** When this state began, by the computer's clock. */
  readonly sinceMs: number;
  /** When the connection is retried, by the computer's clock; null if no attempt is planned. */
  readonly retryAtMs: number | null;
}

/** For the last moments, reported twice a second. Null: unknown. */
export interface VideoStats {
  /**
   * From the camera to the screen, of the pictures drawn since the last report, else of the last one: the median and
   * the maximum.
   */
  readonly delayMs: number | null;
  readonly worstDelayMs: number | null;
  /** Time since the last new picture. Null before the first one. */
  readonly stillMs: number | null;
  /** Pictures drawn per second. */
  readonly rateHz: number;
  readonly bitsPerS: number;
  /** Pictures that never arrived since the view began, and those that the tower skipped because we were too slow. */
  readonly lost: number;
  readonly skipped: number;
  /** Time to decode one picture. */
  readonly decodeMs: number | null;
  /** Of the visible picture, in pixels; 0 before the first. */
  readonly width: number;
  readonly height: number;
}

export type ToPlayer =
  | {
      readonly type: 'open';
      readonly canvas: OffscreenCanvas;
      /** The page's location: a worker's own address is that of its script. */
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
