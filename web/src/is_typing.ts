/** Keys for a field, or for an open dialog or menu, are neither sticks nor shortcuts. */
export function isTyping({ target }: { readonly target: EventTarget | null }): boolean {
  if (document.querySelector('[role="dialog"], [role="menu"]')) return true;
  return target instanceof HTMLElement && target.closest('input, select, textarea, [contenteditable]') !== null;
}
