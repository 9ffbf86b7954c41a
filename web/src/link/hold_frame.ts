/**
 * The one command that the console still sends as MAVLink itself: the switch to the hold mode. It leaves with the next
 * frame, without a request in between. All others are operations of the tower (drone_commands.ts).
 */

import { t } from '../languages/text';
import type { Clock } from './clock';
import { MAV_CMD, MAV_RESULT, MAV_STATE, type MessageFields } from './generated/mavlink.gen';
import type { Message } from './mavlink';
import { CONSOLE } from './messages';
import { holdModeOf, type Mode } from './modes';
import { REPLACED, type Outcome } from './outcome';
import type { Telemetry } from './telemetry';

export const ANSWER_LIMIT_MS = 3_000;
/** The limit after each IN_PROGRESS: the autopilot has received the command and works on it. */
export const PROGRESS_LIMIT_MS = 20_000;
const CONFIRM_LIMIT_MS = 3_000;
/** param1 of DO_SET_MODE: MAV_MODE_FLAG_CUSTOM_MODE_ENABLED. */
const CUSTOM_MODE = 1;
const COMMAND = MAV_CMD.DO_SET_MODE;

const NOT_HEARD: Outcome = { kind: 'failed', why: t('no heartbeat from its autopilot yet') };
const NOT_KNOWN: Outcome = { kind: 'failed', why: t('this console does not know the hold modes of its autopilot') };
const NOT_SENT: Outcome = { kind: 'failed', why: t('not sent: no connection') };

/** Sends a COMMAND_LONG to the autopilot; false when nothing could be sent. */
export type Transmit = (fields: Partial<MessageFields['COMMAND_LONG']>) => boolean;

/** A hold in progress. */
interface Waiting {
  readonly mode: Mode;
  readonly settle: (outcome: Outcome) => void;
  isAccepted: boolean;
  /** Its newest HEARTBEAT since the command shows the mode, and it is nobody's failsafe that chose it. */
  isShown: boolean;
  cancelTimer: () => void;
}

export class HoldFrame {
  readonly #clock: Clock;
  readonly #telemetry: Telemetry;
  readonly #transmit: Transmit;
  #waiting: Waiting | null = null;

  constructor(clock: Clock, telemetry: Telemetry, transmit: Transmit) {
    this.#clock = clock;
    this.#telemetry = telemetry;
    this.#transmit = transmit;
    telemetry.onMessage((message) => this.#receive(message));
  }

  /** Succeeds when the autopilot has accepted it and its HEARTBEAT agrees. A newer hold replaces an older one. */
  send(): Promise<Outcome> {
    const heartbeat = this.#telemetry.newest('HEARTBEAT');
    if (!heartbeat) return Promise.resolve(NOT_HEARD);
    const mode = holdModeOf(heartbeat.fields.autopilot, heartbeat.fields.type);
    if (!mode) return Promise.resolve(NOT_KNOWN);
    this.#waiting?.settle(REPLACED);
    return new Promise((resolve) => {
      const waiting: Waiting = {
        mode,
        isAccepted: false,
        isShown: false,
        cancelTimer: () => undefined,
        settle: (outcome) => {
          waiting.cancelTimer();
          this.#waiting = null;
          resolve(outcome);
        },
      };
      this.#waiting = waiting;
      this.#try(waiting, 0);
    });
  }

  /** Ends the pending hold: the connection broke, or the tower refused our frames. */
  abort(why: string): void {
    this.#waiting?.settle({ kind: 'failed', why });
  }

  /** `confirmation`: the number of earlier transmissions; sent twice at most. */
  #try(waiting: Waiting, confirmation: number): void {
    const { main, sub } = waiting.mode;
    const isSent = this.#transmit({ command: COMMAND, param1: CUSTOM_MODE, param2: main, param3: sub, confirmation });
    if (!isSent) return waiting.settle(NOT_SENT);
    waiting.cancelTimer = this.#clock.after(ANSWER_LIMIT_MS, () => {
      // Only the answer is lost, or the command did nothing: another one would say nothing more.
      if (waiting.isShown) waiting.settle({ kind: 'accepted' });
      else if (confirmation === 0) this.#try(waiting, 1);
      else waiting.settle({ kind: 'no-answer' });
    });
  }

  #receive(message: Message): void {
    const waiting = this.#waiting;
    if (!waiting || !this.#telemetry.isFromAutopilot(message)) return;
    if (message.name === 'COMMAND_ACK' && message.fields.command === COMMAND) {
      const { result, target_system: asked } = message.fields;
      // The agent changes modes too, and the answers to it pass through here.
      if (waiting.isAccepted || (asked !== 0 && asked !== CONSOLE.sysid)) return;
      if (result === MAV_RESULT.ACCEPTED) this.#accepted(waiting);
      else if (result !== MAV_RESULT.IN_PROGRESS) waiting.settle({ kind: 'refused', result });
      else this.#after(waiting, PROGRESS_LIMIT_MS, { kind: 'no-answer' });
    } else if (message.name === 'HEARTBEAT') {
      const { custom_mode: mode, system_status: status } = message.fields;
      waiting.isShown = mode === waiting.mode.customMode && status !== MAV_STATE.CRITICAL;
      if (waiting.isAccepted) this.#look(waiting);
    }
  }

  #accepted(waiting: Waiting): void {
    waiting.isAccepted = true;
    const detail = t('its heartbeat does not show {mode}', { mode: waiting.mode.name });
    this.#after(waiting, CONFIRM_LIMIT_MS, { kind: 'unconfirmed', detail });
    this.#look(waiting);
  }

  #look(waiting: Waiting): void {
    if (this.#telemetry.newest('HEARTBEAT')?.fields.custom_mode === waiting.mode.customMode)
      waiting.settle({ kind: 'accepted' });
  }

  #after(waiting: Waiting, delayMs: number, outcome: Outcome): void {
    waiting.cancelTimer();
    waiting.cancelTimer = this.#clock.after(delayMs, () => waiting.settle(outcome));
  }
}
