/** H.264 by the browser's own decoder (WebCodecs), configured to hold nothing back. */

import { codecString } from './annex_b';
import { planesOf } from './frame_planes';
import type { Planes } from './screen';
import type { Unit } from './unit';

const LOW_DELAY = { optimizeForLatency: true } as const;
/** Baseline, level 3.1: every browser with H.264 supports it. */
const SIMPLEST = 'avc1.42C01F';

export async function hasH264(): Promise<boolean> {
  if (!('VideoDecoder' in globalThis)) return false;
  try {
    return (await VideoDecoder.isConfigSupported({ codec: SIMPLEST, ...LOW_DELAY })).supported === true;
  } catch {
    return false;
  }
}

export class H264Decoder {
  readonly #onPicture: (picture: Planes | VideoFrame, unit: Unit) => void;
  readonly #onFault: (words: string) => void;
  #decoder: VideoDecoder | null = null;
  #codec = '';
  #count = 0;
  /** By the number that we pass as each unit's timestamp. */
  readonly #inside = new Map<number, Unit>();

  /**
   * `onPicture` owns the picture, and closes it if it is a frame. `onFault`: no more pictures before the next key
   * picture.
   */
  constructor(onPicture: (picture: Planes | VideoFrame, unit: Unit) => void, onFault: (words: string) => void) {
    this.#onPicture = onPicture;
    this.#onFault = onFault;
  }

  decode(unit: Unit): void {
    try {
      if (unit.isKey) this.#prepare(unit);
      if (!this.#decoder) return;
      const timestamp = this.#count++;
      this.#inside.set(timestamp, unit);
      this.#decoder.decode(
        new EncodedVideoChunk({ type: unit.isKey ? 'key' : 'delta', timestamp, data: unit.payload }),
      );
    } catch (error) {
      this.#fail(error);
    }
  }

  close(): void {
    const decoder = this.#decoder;
    this.#decoder = null;
    this.#codec = '';
    this.#inside.clear();
    if (decoder && decoder.state !== 'closed') decoder.close();
  }

  #prepare({ payload }: Unit): void {
    const codec = codecString(payload);
    if (codec === null || (this.#decoder && codec === this.#codec)) return;
    this.close();
    const decoder = new VideoDecoder({
      output: (picture) => {
        if (decoder === this.#decoder) this.#decoded(picture);
        else picture.close();
      },
      error: (error) => {
        if (decoder === this.#decoder) this.#fail(error);
      },
    });
    this.#decoder = decoder;
    this.#codec = codec;
    decoder.configure({ codec, ...LOW_DELAY });
  }

  #decoded(frame: VideoFrame): void {
    const unit = this.#inside.get(frame.timestamp);
    // A picture that the decoder skipped will not come.
    for (const number of this.#inside.keys()) if (number <= frame.timestamp) this.#inside.delete(number);
    if (unit) void this.#handOn(frame, unit);
    else frame.close();
  }

  async #handOn(frame: VideoFrame, unit: Unit): Promise<void> {
    const from = this.#decoder;
    const planes = await planesOf(frame).catch(() => null);
    if (planes || from !== this.#decoder) frame.close();
    if (from === this.#decoder) this.#onPicture(planes ?? frame, unit);
  }

  #fail(error: unknown): void {
    this.close();
    this.#onFault(error instanceof Error ? error.message : String(error));
  }
}
