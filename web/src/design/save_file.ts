/** Saves generated content as a file through the browser. */

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
  // The browser reads it after this function returns.
  setTimeout(() => URL.revokeObjectURL(address), KEPT_MS);
}

/** A file name valid on every system: letters, digits, dots and dashes. */
export const fileName = (words: string, ending: string): string =>
  `${words.replace(/[^\p{L}\p{N}]+/gu, '-').replace(/^-+|-+$/g, '') || 'drone'}.${ending}`;
