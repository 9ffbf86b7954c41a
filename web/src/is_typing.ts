/** Keys that are meant for a field, or for a dialog or menu that is open, are neither sticks nor shortcuts. */
export function isTyping({ target }: { readonly target: EventTarget | null }): boolean {
  if (document.querySelector('[role="dialog"], [role="menu"]')) return true;
  return target instanceof HTMLElement && target.closest('input, select, textarea, [contenteditable]') !== null;
}
