/** Asks before a dangerous action. One question at a time; the dialog is parts/ConfirmDialog.svelte. */

import type { LossSentence } from './link/safety_types';

export interface Question {
  readonly title: string;
  /** Names the drone and what it will do. */
  readonly text: string;
  readonly confirmLabel: string;
  readonly isDanger?: boolean;
  /** If given, also asks for a reason, under this label. */
  readonly reasonLabel?: string;
  /** If given, also shows a checkbox, ticked by default. */
  readonly checkLabel?: string;
  /** If given, shows a second checkbox, which has no effect while the first is unticked. */
  readonly secondCheckLabel?: string;
  /** The drone's name, which the user must type to agree to a danger. */
  readonly nameToType?: string;
  /** A second way to confirm, beside `confirmLabel`. It has the initial focus, so Enter takes it. */
  readonly otherLabel?: string;
  /**
   * How long the confirming button is held (docs/console.md, "Confirmation"): LEAVES_OR_ENDS_S for what leaves the ground
   * or ends a flight, FALLS_S for what makes a machine fall. Without it a press is enough.
   */
  readonly heldS?: number;
  /** What is open before a flight, shown beside that button. */
  readonly warnings?: readonly string[];
  /** To read before answering. */
  readonly sentences?: readonly LossSentence[];
}

export const LEAVES_OR_ENDS_S = 1;
export const FALLS_S = 3;

export interface Consent {
  readonly reason: string;
  readonly isChecked: boolean;
  /** False while the first is unticked. */
  readonly isSecondChecked: boolean;
  /** `otherLabel` was pressed. */
  readonly isOther: boolean;
}

interface Asked extends Question {
  readonly answer: (consent: Consent | null) => void;
}

export const confirmation = $state<{ asked: Asked | null }>({ asked: null });

/** Closes the question unanswered: its page, user or subject has gone. */
export const dismiss = (): void => confirmation.asked?.answer(null);

/** Resolves to null when the user cancels. */
export function ask(question: Question): Promise<Consent | null> {
  dismiss();
  return new Promise((resolve) => {
    confirmation.asked = {
      ...question,
      answer: (consent) => {
        confirmation.asked = null;
        resolve(consent);
      },
    };
  });
}
