/** Hands what we made to the browser as a file. */

const KEPT_MS = 10_000;

export function saveFile(name: string, text: string, mediaType = 'text/plain'): void {
  saveBlob(name, new Blob([text], { type: mediaType }));
}

export function saveBlob(name: string, blob: Blob): void {
  const address = URL.createObjectURL(blob);
  const link = document.createElement('a');
  link.href = address;
  link.download = name;
  link.click();
  // The browser reads it after this returns.
  setTimeout(() => URL.revokeObjectURL(address), KEPT_MS);
}

/** What a file may be called on every system: letters, digits, dots and strokes. */
export const fileName = (words: string, ending: string): string =>
  `${words.replace(/[^\p{L}\p{N}]+/gu, '-').replace(/^-+|-+$/g, '') || 'drone'}.${ending}`;
