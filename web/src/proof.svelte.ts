/**
 * Asks for a proof of identity: the tower requires a fresh one before credentials change. The dialog is
 * parts/ProofDialog.svelte.
 */

interface AskedForProof {
  /** True: the proof was given, and the original request is repeated. */
  readonly answer: (isProved: boolean) => void;
}

export const proof = $state<{ asked: AskedForProof | null }>({ asked: null });
let pending: Promise<boolean> | null = null;

/** Simultaneous requests for a proof share one question. */
export function askForProof(): Promise<boolean> {
  pending ??= new Promise<boolean>((resolve) => {
    proof.asked = {
      answer: (isProved) => {
        proof.asked = null;
        pending = null;
        resolve(isProved);
      },
    };
  });
  return pending;
}
