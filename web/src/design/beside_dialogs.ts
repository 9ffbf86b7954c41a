/**
 * Keeps one part of the page usable while a dialog is open: pointer, touch, and Tab reach it, and the dialog stays open.
 * A dialog (design/Dialog.svelte) traps the focus; its trap listens on the document, so this listens on the window,
 * which hears first.
 */

/** The part's id, which dialogs name as their own for screen readers. */
export const BESIDE_DIALOGS_ID = 'beside-dialogs';

const FOCUSABLE =
  'a[href], button:not(:disabled), input:not(:disabled), select:not(:disabled), textarea:not(:disabled), [tabindex="0"]';

const isSeen = (part: HTMLElement): boolean => part.getClientRects().length > 0;
const stopsOf = (part: Element): HTMLElement[] =>
  [...part.querySelectorAll<HTMLElement>(FOCUSABLE)].filter((one) => one.tabIndex >= 0 && isSeen(one));
const topDialog = (): Element | undefined => [...document.querySelectorAll('[role="dialog"]')].at(-1);

export const isBesideDialogs = (target: EventTarget | null): boolean =>
  target instanceof Element && target.closest(`#${BESIDE_DIALOGS_ID}`) !== null;

/** For `{@attach}` on the part. */
export function besideDialogs(part: HTMLElement): () => void {
  function onfocusin(event: FocusEvent): void {
    if (topDialog() && event.target instanceof Node && part.contains(event.target)) event.stopPropagation();
  }

  function onkeydown(event: KeyboardEvent): void {
    const dialog = event.key === 'Tab' ? topDialog() : undefined;
    if (!dialog || event.ctrlKey || event.altKey || event.metaKey) return;
    const [inDialog, inPart] = [stopsOf(dialog), stopsOf(part)];
    const round = [...inDialog, ...inPart];
    const at = round.findIndex((one) => one === document.activeElement);
    // Inside a group of radio buttons, and from a menu, the browser knows the way.
    if (at < 0 || inPart.length === 0) return;
    const next = round.at((at + (event.shiftKey ? -1 : 1)) % round.length);
    const crosses = next !== undefined && inPart.includes(next) !== inPart.includes(round[at]!);
    if (!crosses && !inPart.includes(round[at]!)) return;
    event.preventDefault();
    event.stopPropagation();
    next?.focus();
  }

  window.addEventListener('focusin', onfocusin, true);
  window.addEventListener('keydown', onkeydown, true);
  return () => {
    window.removeEventListener('focusin', onfocusin, true);
    window.removeEventListener('keydown', onkeydown, true);
  };
}
