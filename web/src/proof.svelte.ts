/** Confirms that it is you: the tower wants a fresh proof before credentials change. The dialog is parts/ProofDialog.svelte. */

interface AskedForProof {
  /** True: the proof was given, and the request that needed it is sent again. */
  readonly answer: (isProved: boolean) => void;
}

export const proof = $state<{ asked: AskedForProof | null }>({ asked: null });
let pending: Promise<boolean> | null = null;

/** Requests that need a proof at the same time share one question. */
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
