/** Speaks alerts with the browser's own voice. A browser without one stays silent. */

/** Too many at once are of no use: the list has the others. */
const MAX_WAITING = 3;
let waiting = 0;

export const canSpeak = (): boolean => 'speechSynthesis' in window;

/** Speaks after what is being spoken. */
export function speak(words: string): void {
  if (!canSpeak() || waiting >= MAX_WAITING) return;
  const said = new SpeechSynthesisUtterance(words);
  said.lang = 'en';
  waiting++;
  said.onend = said.onerror = () => waiting--;
  window.speechSynthesis.speak(said);
}

/** Ends at once, also what waits. */
export function beQuiet(): void {
  if (!canSpeak()) return;
  window.speechSynthesis.cancel();
  waiting = 0;
}
