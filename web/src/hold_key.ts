/** The key of Hold, from anywhere but a text field: under dialogs and menus, on every page. */

const NOT_TEXT = new Set(['checkbox', 'radio', 'range', 'button', 'submit', 'reset', 'color', 'file', 'number']);

/** Whether a key goes into text. A number field takes no letter. */
function takesLetters(target: EventTarget | null): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target.isContentEditable || target instanceof HTMLTextAreaElement) return true;
  return target instanceof HTMLInputElement && !NOT_TEXT.has(target.type);
}

/** Caps Lock does not matter: it is urgent. */
export function isHoldKey(event: KeyboardEvent): boolean {
  if (event.key !== 'h' && event.key !== 'H') return false;
  if (event.ctrlKey || event.metaKey || event.altKey || event.repeat || event.isComposing) return false;
  return !takesLetters(event.target);
}
