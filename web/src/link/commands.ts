/**
 * A command and its answer. Sends COMMAND_LONG or COMMAND_INT, waits for the COMMAND_ACK of that command from
 * the autopilot, repeats once where that is safe, and says in words what came of it.
 */

import type { Clock } from './clock';
import { MAV_RESULT } from './generated/mavlink.gen';
import type { Message } from './mavlink';
import type { Command } from './messages';

export const ANSWER_LIMIT_MS = 3_000;
/** After IN_PROGRESS the autopilot is at work: it has told us that it heard. */
export const PROGRESS_LIMIT_MS = 20_000;

export type Outcome =
  | { readonly kind: 'accepted' }
  | { readonly kind: 'refused'; readonly result: number }
  | { readonly kind: 'no-answer' }
  /** Accepted, but the HEARTBEAT never agreed. */
  | { readonly kind: 'unconfirmed'; readonly detail: string }
  /** Nobody can say whether it was carried out, or it was not sent at all: `why` says. */
  | { readonly kind: 'failed'; readonly why: string }
  /** By way of the tower: it, or the agent, has said how it ended, in a whole sentence. */
  | { readonly kind: 'told'; readonly isDone: boolean; readonly words: string };

export const isGood = (outcome: Outcome): boolean =>
  outcome.kind === 'accepted' || (outcome.kind === 'told' && outcome.isDone);

export const REPLACED: Outcome = { kind: 'failed', why: 'a newer command took its place' };

/** Sends the command (repeat = 0 at first, then 1); false when nothing could be sent. */
export type Transmit = (command: Command, repeat: number) => boolean;

interface Pending {
  readonly command: Command;
  readonly settle: (outcome: Outcome) => void;
  cancelTimer: () => void;
}

const MAV_RESULT_CANCELLED = 6;
const MAV_RESULT_UNSUPPORTED_FRAME = 9;
const MAV_RESULT_NOT_IN_CONTROL = 10;

const RESULT_WORDS: Record<number, string> = {
  [MAV_RESULT.TEMPORARILY_REJECTED]: 'cannot do it now (temporarily rejected)',
  [MAV_RESULT.DENIED]: 'denied it',
  [MAV_RESULT.UNSUPPORTED]: 'does not know this command',
  [MAV_RESULT.FAILED]: 'could not do it (failed)',
  [MAV_RESULT_CANCELLED]: 'cancelled it',
  [MAV_RESULT.COMMAND_LONG_ONLY]: 'takes this command as COMMAND_LONG only',
  [MAV_RESULT.COMMAND_INT_ONLY]: 'takes this command as COMMAND_INT only',
  [MAV_RESULT_UNSUPPORTED_FRAME]: 'does not know this coordinate frame',
  [MAV_RESULT_NOT_IN_CONTROL]: 'says that we are not in control',
};

export function outcomeWords(droneName: string, outcome: Outcome): string {
  switch (outcome.kind) {
    case 'accepted':
      return `${droneName} accepted it`;
    case 'refused':
      return `${droneName} ${RESULT_WORDS[outcome.result] ?? `refused it (result ${outcome.result})`}`;
    case 'no-answer':
      return `${droneName} did not answer. Watch what it does before you try again`;
    case 'unconfirmed':
      return `${droneName} accepted it, but ${outcome.detail}`;
    case 'failed':
      return `${droneName}: ${outcome.why}`;
    case 'told':
      return outcome.words;
  }
}

export class Commands {
  readonly #clock: Clock;
  readonly #transmit: Transmit;
  readonly #pending = new Map<number, Pending>();

  constructor(clock: Clock, transmit: Transmit) {
    this.#clock = clock;
    this.#transmit = transmit;
  }

  run(command: Command): Promise<Outcome> {
    // COMMAND_ACK names the command only: two of one kind under way could not be told apart.
    const older = this.#pending.get(command.command);
    if (older && command.replaces) {
      older.settle(REPLACED);
    } else if (older) {
      return Promise.resolve({ kind: 'failed', why: 'the same command is still waiting for its answer' });
    }
    return new Promise((resolve) => {
      const settle = (outcome: Outcome): void => {
        pending.cancelTimer();
        this.#pending.delete(command.command);
        resolve(outcome);
      };
      const pending: Pending = { command, settle, cancelTimer: () => undefined };
      this.#pending.set(command.command, pending);
      this.#send(pending, 0);
    });
  }

  /** Give it each message of the drone's autopilot. */
  receive(message: Message): void {
    if (message.name !== 'COMMAND_ACK') return;
    const { command, result } = message.fields;
    const pending = this.#pending.get(command);
    if (!pending) return;
    if (result === MAV_RESULT.IN_PROGRESS) {
      pending.cancelTimer();
      pending.cancelTimer = this.#clock.after(PROGRESS_LIMIT_MS, () => pending.settle({ kind: 'no-answer' }));
    } else if (result === MAV_RESULT.ACCEPTED) {
      pending.settle({ kind: 'accepted' });
    } else {
      pending.settle({ kind: 'refused', result });
    }
  }

  /** Ends all that wait: the connection broke, or the tower refused our frames. */
  abort(why: string): void {
    for (const pending of [...this.#pending.values()]) pending.settle({ kind: 'failed', why });
  }

  #send(pending: Pending, repeat: number): void {
    if (!this.#transmit(pending.command, repeat)) {
      pending.settle({ kind: 'failed', why: 'not sent: there is no connection to it' });
      return;
    }
    pending.cancelTimer = this.#clock.after(ANSWER_LIMIT_MS, () => {
      if (repeat === 0 && pending.command.repeatable) this.#send(pending, repeat + 1);
      else pending.settle({ kind: 'no-answer' });
    });
  }
}
