/**
 * Another connection beside the present one, when the tower ends its work (`leave_tower`): the page leaves its tower
 * only once another one has welcomed it, so that sticks go on. Same address: the proxy, or the name, leads elsewhere.
 */

import type { Clock } from './clock';
import type { SocketLike } from './live';
import { readTowerEvent } from './wire_types';

const WELCOME_LIMIT_MS = 2_000;

export interface LiveMoveOptions {
  readonly clock: Clock;
  readonly openSocket: () => SocketLike;
  /** The other connection is open; `welcome` is its first message, not yet acted upon. */
  readonly onWelcome: (socket: SocketLike, welcome: string) => void;
}

export class LiveMove {
  readonly #options: LiveMoveOptions;
  #socket: SocketLike | null = null;
  #cancelTimer: () => void = () => undefined;

  constructor(options: LiveMoveOptions) {
    this.#options = options;
  }

  /** The tower says it again until it is left; while an attempt is on, nothing happens. */
  begin(): void {
    if (this.#socket) return;
    let socket: SocketLike;
    try {
      socket = this.#options.openSocket();
    } catch {
      return;
    }
    this.#socket = socket;
    socket.binaryType = 'arraybuffer';
    socket.onclose = () => this.stop();
    socket.onmessage = ({ data }) => {
      if (typeof data !== 'string' || readTowerEvent(data)?.type !== 'welcome') return;
      this.#forget();
      this.#options.onWelcome(socket, data);
    };
    this.#cancelTimer = this.#options.clock.after(WELCOME_LIMIT_MS, () => this.stop());
  }

  stop(): void {
    const socket = this.#socket;
    this.#forget();
    socket?.close();
  }

  #forget(): void {
    this.#cancelTimer();
    if (this.#socket) this.#socket.onmessage = this.#socket.onclose = null;
    this.#socket = null;
  }
}
