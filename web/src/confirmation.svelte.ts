/** Asks before a dangerous action. One question at a time; the dialog is parts/ConfirmDialog.svelte. */

import type { LossSentence } from './link/safety_types';

export interface Question {
  readonly title: string;
  /** Names the drone and says what it will do. */
  readonly text: string;
  readonly confirmLabel: string;
  readonly isDanger?: boolean;
  /** Asks for a reason too, under this label. */
  readonly reasonLabel?: string;
  /** Asks for a yes or no too, which is yes unless unticked. */
  readonly checkLabel?: string;
  /** And one more, which means nothing where that is unticked. */
  readonly secondCheckLabel?: string;
  /** The drone's name, to be typed before a danger is agreed to. */
  readonly nameToType?: string;
  /** Another way to go on, beside `confirmLabel`, which has the focus then: Enter takes it. */
  readonly otherLabel?: string;
  /** To be read before the answer. */
  readonly sentences?: readonly LossSentence[];
}

export interface Consent {
  readonly reason: string;
  readonly isChecked: boolean;
  /** False where the first one is. */
  readonly isSecondChecked: boolean;
  /** `otherLabel` was pressed. */
  readonly isOther: boolean;
}

interface Asked extends Question {
  readonly answer: (consent: Consent | null) => void;
}

export const confirmation = $state<{ asked: Asked | null }>({ asked: null });

/** Nobody answers any more: whoever asked, or what it was about, has gone. */
export const dismiss = (): void => confirmation.asked?.answer(null);

/** Null when the user thought better of it. */
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
