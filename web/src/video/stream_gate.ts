/** Passes only what can be decoded: after a gap, a break or a new stream nothing before the next key picture. */

import type { Unit } from './unit';

/** A larger jump is no loss: the stream restarted. About half a minute. */
const MAX_LOSS = 1000;

type Head = Pick<Unit, 'quality' | 'codec' | 'sequence' | 'isKey' | 'isBreak'>;

export class StreamGate {
  #last: Head | null = null;
  #isOpen = false;
  /** Units that never arrived, since the view began. */
  lost = 0;

  /** The next unit does not continue the previous one: another connection. */
  restart(): void {
    this.#last = null;
    this.#isOpen = false;
  }

  /** A unit that passed could not be decoded. */
  shut(): void {
    this.#isOpen = false;
  }

  admits(head: Head): boolean {
    const last = this.#last;
    this.#last = head;
    if (!last || last.quality !== head.quality || last.codec !== head.codec) {
      this.#isOpen = false;
    } else {
      const missing = (head.sequence - last.sequence - 1) >>> 0;
      if (missing > 0) this.#isOpen = false;
      if (missing <= MAX_LOSS) this.lost += missing;
    }
    if (head.isBreak) this.#isOpen = false;
    if (head.isKey) this.#isOpen = true;
    return this.#isOpen;
  }
}
