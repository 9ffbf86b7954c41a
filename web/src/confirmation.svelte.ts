/** Asks before a dangerous action. One question at a time; the dialog is parts/ConfirmDialog.svelte. */

export interface Question {
  readonly title: string;
  /** Names the drone and says what it will do. */
  readonly text: string;
  readonly confirmLabel: string;
  readonly isDanger?: boolean;
  /** Asks for a reason too, under this label. */
  readonly reasonLabel?: string;
}

export interface Consent {
  readonly reason: string;
}

interface Asked extends Question {
  readonly answer: (consent: Consent | null) => void;
}

export const confirmation = $state<{ asked: Asked | null }>({ asked: null });

/** Null when the user thought better of it. */
export function ask(question: Question): Promise<Consent | null> {
  confirmation.asked?.answer(null);
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
