/**
 * What the tower pushes to a browser, and what is made of it: a notification, and a page for whoever clicks on it.
 * No browser in here: push.ts has the events.
 */

export interface AlertNote {
  readonly title: string;
  readonly body: string;
  readonly severity: string;
  /** `opened`, `closed`, `unanswered` or `test`. */
  readonly happening: string;
  /** The same for all notes about one alert: the newest one replaces the others. */
  readonly tag: string;
  /** Of a page of the console, relative to its address: `#/drone/5`. */
  readonly path: string;
}

/** TypeScript's library lacks `renotify`. */
export interface NoteOptions extends NotificationOptions {
  readonly renotify: boolean;
  readonly data: { readonly path: string };
}

const FIELDS = ['title', 'body', 'severity', 'happening', 'tag', 'path'] as const;
const UNREADABLE: AlertNote = {
  title: 'Control Tower',
  body: 'An alert that this version of the console cannot read. Open the console.',
  severity: 'warning',
  happening: 'opened',
  tag: 'unreadable',
  path: '#/',
};

/** A browser must show something for each message: what cannot be read becomes a note that says so. */
export function noteOf(text: string): AlertNote {
  let said: unknown;
  try {
    said = JSON.parse(text);
  } catch {
    return UNREADABLE;
  }
  if (typeof said !== 'object' || said === null) return UNREADABLE;
  const fields = said as Readonly<Record<string, unknown>>;
  if (FIELDS.some((name) => typeof fields[name] !== 'string')) return UNREADABLE;
  const note = said as AlertNote;
  return note.path.startsWith('#/') ? note : { ...note, path: UNREADABLE.path };
}

export function optionsOf({ body, severity, happening, tag, path }: AlertNote, icon: string): NoteOptions {
  const isNews = happening === 'opened' || happening === 'unanswered';
  return {
    body,
    tag,
    icon,
    data: { path },
    // A second message of a beginning, after a failure of the tower, makes no second noise; a question does.
    renotify: happening === 'unanswered',
    requireInteraction: isNews && severity === 'critical',
    silent: happening === 'closed',
  };
}

export interface OpenPage {
  readonly url: string;
  readonly focused: boolean;
  readonly visibilityState: string;
}

/** The open console that comes to the front, or null: a new one is opened. It stays at its page, because its user may
 * be flying from it; the alert is in its list. */
export function pageToFocus<T extends OpenPage>(pages: readonly T[], scope: string): T | null {
  const ours = pages.filter(({ url }) => url.startsWith(scope));
  const shown =
    ours.find(({ focused }) => focused) ?? ours.find(({ visibilityState }) => visibilityState === 'visible');
  return shown ?? ours[0] ?? null;
}
