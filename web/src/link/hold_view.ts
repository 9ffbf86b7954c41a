/** An open hold and a lost action in words: what the drone does now, what it will do, and when. Pure. */

import { t } from '../languages/text';
import type { HoldView, LostAction } from './wire_types';

export interface HoldReading {
  readonly phase: HoldView['phase'];
  readonly tone: 'good' | 'warning';
  /** One line with the drone's name. */
  readonly title: string;
  /** More sentences on the same. */
  readonly notes: readonly string[];
  /** A few words for a list row. */
  readonly badge: string;
  /** Until the lost action; null without a countdown. 0 once it is due. */
  readonly secondsLeft: number | null;
  /** For screen readers: changes with the state, not every second. */
  readonly said: string;
  /** Why nobody flies it; empty where somebody does, or it is not known. */
  readonly because: string;
  /** Whether "stay" would stop the lost action now. */
  readonly canStay: boolean;
}

export interface HoldContext {
  readonly droneName: string;
  readonly lostActionS: number;
  /** Our clock minus the tower's time of day. */
  readonly towerLagMs: number;
}

export const DOES: Record<LostAction, string> = {
  return: t('returns'),
  land: t('lands'),
  continue: t('goes on with its mission'),
  stay: t('stays where it is'),
};
const TO_DO: Record<LostAction, string> = {
  return: t('return'),
  land: t('land'),
  continue: t('go on with its mission'),
  stay: t('stay where it is'),
};
export const DOING: Record<LostAction, string> = {
  return: t('returning'),
  land: t('landing'),
  continue: t('going on with its mission'),
  stay: t('staying where it is'),
};
const IF_AGENT_STOPS: Record<HoldView['after_sticks'], (name: string) => string> = {
  stays: () => '',
  sinks: (name) => t('If its agent stops, {name} sinks to the ground.', { name }),
  returns: (name) => t('If its agent stops, the autopilot returns {name}.', { name }),
  lands: (name) => t('If its agent stops, the autopilot lands {name}.', { name }),
  unknown: (name) => t('It is not known what {name} does if its agent stops.', { name }),
};

/** A mode's name as the console displays it. */
export const plainMode = (mode: string): string => mode.replaceAll('_', ' ');

const capital = (text: string): string => text.charAt(0).toUpperCase() + text.slice(1);
const ended = (text: string): string => (/[.!?]$/.test(text) ? text : `${text}.`);

/** A newer tower may report an action unknown to this console. */
const knownAction = (action: HoldView['action']): LostAction | null =>
  action !== null && action in DOES ? action : null;

/** On our clock; null without a countdown. */
export function dueMs(hold: HoldView | null, towerLagMs: number): number | null {
  const atMs = hold?.phase === 'counting' && hold.due_at !== null ? Date.parse(hold.due_at) + towerLagMs : NaN;
  return Number.isFinite(atMs) ? atMs : null;
}

/** Without the final full stop. */
function nowWords(name: string, hold: HoldView): string {
  const mode = plainMode(hold.mode);
  if (!hold.open)
    return mode ? t('{name} flies on in {mode}', { name, mode }) : t('It is not known what {name} is doing', { name });
  if (hold.stage === 'none') return t('{name} was ordered to hold, not confirmed yet', { name });
  if (hold.stage === 'altitude') {
    return t('{name} holds height only: {waitingFor}', {
      name,
      waitingFor: hold.waiting_for.replace(/\.$/, '') || t('still slowing down'),
    });
  }
  return hold.sticks
    ? t('{name} holds: {mode}, sticks kept by its agent', { name, mode })
    : t('{name} holds: {mode}, stays by itself', { name, mode });
}

function nowBadge(hold: HoldView): string {
  if (!hold.open) return t('Flies on: {mode}', { mode: plainMode(hold.mode) });
  if (hold.stage === 'none') return t('Hold not confirmed');
  return hold.stage === 'altitude' ? t('Holds height only') : t('Holds: {mode}', { mode: plainMode(hold.mode) });
}

const whyNow = (lost: HoldView['lost']): string =>
  lost === 'tower' ? t(': it has lost the tower') : lost === 'person' ? t(': nobody flies it') : '';
const whyThen = (lost: HoldView['lost'], afterS: number): string =>
  lost === 'tower'
    ? t(': it had lost the tower for {after} s', { after: afterS })
    : lost === 'person'
      ? t(': nobody flew it for {after} s', { after: afterS })
      : '';

/** Rounded, so that screen readers announce it two or three times and not every second. */
function aboutWords(secondsLeft: number | null): string {
  if (secondsLeft === null) return '';
  const bound = [10, 30, 60].find((seconds) => secondsLeft <= seconds);
  return bound === undefined ? ` ${t('in more than a minute')}` : ` ${t('in less than {bound} s', { bound })}`;
}

/** `isSetting`: to stay is the drone's lost action; else somebody said it, which lasts ten minutes. */
function stayedTitle(name: string, isOpen: boolean, isSetting: boolean): string {
  if (isSetting)
    return isOpen
      ? t('{name} stays until the battery is needed for the way home', { name })
      : t('{name} flies on until the battery is needed for the way home', { name });
  return isOpen
    ? t('{name} stays for ten minutes, or until the battery is needed for the way home', { name })
    : t('{name} flies on for ten minutes, or until the battery is needed for the way home', { name });
}

/** The text of the lost action; null while nobody is lost. */
function actionWords(
  hold: HoldView,
  { droneName: name, lostActionS }: HoldContext,
  secondsLeft: number | null,
): { readonly title: string; readonly badge: string; readonly said?: string } | null {
  const action = knownAction(hold.action);
  switch (hold.phase) {
    case 'quiet':
      return null;
    case 'stayed':
      return {
        title: stayedTitle(name, hold.open, action === 'stay'),
        badge: hold.open ? t('Stays') : t('Flies on'),
      };
    case 'counting': {
      const why = whyNow(hold.lost);
      if (action === null)
        return { title: t('What {name} will do is not known{why}', { name, why }), badge: t('Nobody flies it') };
      if (hold.stale && secondsLeft === 0) {
        const should = t('should be {doing} now', { doing: DOING[action] });
        return { title: `${name} ${should}${why}`, badge: capital(should) };
      }
      const does = hold.stale ? t('should {toDo}', { toDo: TO_DO[action] }) : DOES[action];
      const when =
        secondsLeft === null
          ? ` ${t('soon')}`
          : secondsLeft > 0
            ? ` ${t('in {secondsLeft} s', { secondsLeft })}`
            : ` ${t('now')}`;
      return {
        title: `${name} ${does}${when}${why}`,
        badge: capital(`${does}${when}`),
        said: `${name} ${does}${secondsLeft === null ? ` ${t('soon')}` : aboutWords(secondsLeft)}${why}`,
      };
    }
    case 'asking': {
      const reported =
        action === null
          ? t('acts by itself')
          : hold.stale
            ? t('was told to {toDo}', { toDo: TO_DO[action] })
            : t('is told to {toDo}', { toDo: TO_DO[action] });
      return { title: `${name} ${reported}${whyThen(hold.lost, lostActionS)}`, badge: capital(reported) };
    }
    case 'done': {
      const does =
        action === null ? t('has acted') : hold.stale ? t('was {doing}', { doing: DOING[action] }) : DOES[action];
      return {
        title: `${name} ${does}${whyThen(hold.lost, lostActionS)}`,
        badge: capital(t('{does}, by itself', { does })),
      };
    }
    default:
      return { title: `${name}: ${String(hold.phase)}`, badge: '' };
  }
}

/** `hold` null: nothing to report. */
export function readHold(hold: HoldView | null, context: HoldContext, nowMs: number): HoldReading | null {
  if (hold === null) return null;
  const name = context.droneName;
  const due = dueMs(hold, context.towerLagMs);
  const secondsLeft = due === null ? null : Math.max(0, Math.ceil((due - nowMs) / 1000));
  const acts = actionWords(hold, context, secondsLeft);
  const now = nowWords(name, hold);
  const title = acts?.title ?? now;

  const notes: string[] = [];
  // A tower of before this field sends none.
  const because = hold.nobody_because ?? '';
  if (acts && because) notes.push(ended(capital(because)));
  if (hold.stale) notes.push(staleWords(hold, context.towerLagMs, nowMs));
  if (acts && hold.phase !== 'done' && hold.phase !== 'asking') notes.push(ended(now));
  if (hold.phase === 'asking') notes.push(t('Not confirmed by the autopilot yet.'));
  if (hold.open && hold.stage === 'altitude' && hold.sticks) notes.push(t('Its agent keeps the sticks centred.'));
  if (hold.open) notes.push(IF_AGENT_STOPS[hold.after_sticks]?.(name) ?? '');
  if (hold.detail) notes.push(ended(capital(hold.detail)));

  const badge = acts?.badge || nowBadge(hold);
  const isSafe = hold.stage === 'stay' && (hold.phase === 'quiet' || hold.phase === 'stayed') && !hold.stale;
  return {
    phase: hold.phase,
    tone: isSafe && hold.after_sticks !== 'sinks' ? 'good' : 'warning',
    title: ended(title),
    notes: notes.filter((note) => note !== ''),
    badge: hold.stale ? t('Last report: {badge}', { badge: badge.charAt(0).toLowerCase() + badge.slice(1) }) : badge,
    secondsLeft,
    said: ended(acts?.said ?? title),
    because,
    canStay: hold.phase === 'counting' && hold.lost === 'person' && hold.action !== 'stay' && !hold.stale,
  };
}

function staleWords({ as_of: asOf }: HoldView, towerLagMs: number, nowMs: number): string {
  const atMs = Date.parse(asOf) + towerLagMs;
  if (!Number.isFinite(atMs)) return t('From the last report of its agent: its link is down.');
  const seconds = Math.max(0, Math.round((nowMs - atMs) / 1000));
  const ago = seconds < 120 ? `${seconds} s` : `${Math.round(seconds / 60)} min`;
  return t('From the last report of its agent, {ago} ago: its link is down.', { ago });
}
