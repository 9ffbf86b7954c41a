/** The user's display preferences, kept in this browser: theme, language, units, audible alerts. */

import { isLanguageChoice, type LanguageChoice } from './languages/languages';
import { PREFERENCES_KEY } from './languages/loading';
import { QUALITIES } from './video/unit';
import type { QualityName } from './video/video_types';
import { isUnitSystem, type UnitSystem } from './words/units';

const THEMES = ['system', 'dark', 'light', 'contrast'] as const;
/** `contrast`: black on white, readable in the sun. */
export type ThemeChoice = (typeof THEMES)[number];

/** The panels of the flight screen, as they stand: the first three on its left. */
export const PANELS = ['values', 'link', 'messages', 'commands', 'checks'] as const;
export type PanelName = (typeof PANELS)[number];

export interface Preferences {
  theme: ThemeChoice;
  /** Takes effect when the page is loaded (languages/loading.ts). */
  language: LanguageChoice;
  units: UnitSystem;
  sound: boolean;
  /** Whether alerts are spoken. */
  speech: boolean;
  /** Whether a phone shakes for critical alerts. */
  vibration: boolean;
  /** Whether single-key shortcuts work on the Control page. */
  shortcuts: boolean;
  /** Whether maps are drawn. Without, a slow device and a metered line have less to do. */
  map: boolean;
  /** Whether the map of the Control page shows the plans on board: mission, fence, rally points. */
  boardPlan: boolean;
  /** Whether the Control page shows the drone's video. */
  video: boolean;
  videoQuality: QualityName;
  /** Whether the live video shows the targets that a controller on board has in view. */
  sightings: boolean;
  /** For each picture on the page of all videos. */
  wallQuality: QualityName;
  /** The panels of the flight screen that the user closed where it has room, and the open one where it has not. */
  closedPanels: readonly PanelName[];
  narrowPanel: PanelName | null;
}

const DEFAULTS: Preferences = {
  theme: 'system',
  language: 'system',
  units: 'metric',
  sound: true,
  speech: false,
  vibration: true,
  shortcuts: true,
  map: true,
  boardPlan: true,
  video: true,
  videoQuality: 'medium',
  sightings: true,
  wallQuality: 'low',
  closedPanels: [],
  narrowPanel: null,
};

export const isTheme = (value: unknown): value is ThemeChoice => THEMES.some((one) => one === value);
const isPanel = (value: unknown): value is PanelName => PANELS.some((one) => one === value);
const isQuality = (value: unknown): value is QualityName => QUALITIES.some((one) => one === value);

function read(): Preferences {
  let stored: Record<string, unknown> = {};
  try {
    stored = (JSON.parse(localStorage.getItem(PREFERENCES_KEY) ?? '{}') as Record<string, unknown> | null) ?? {};
  } catch {
    // The page starts even if storage is forbidden or corrupt.
  }
  const { theme, language, units, sound, speech, vibration, shortcuts, map, boardPlan } = stored;
  const { video, videoQuality, sightings, wallQuality, closedPanels, narrowPanel } = stored;
  return {
    theme: isTheme(theme) ? theme : DEFAULTS.theme,
    language: isLanguageChoice(language) ? language : DEFAULTS.language,
    units: isUnitSystem(units) ? units : DEFAULTS.units,
    sound: typeof sound === 'boolean' ? sound : DEFAULTS.sound,
    speech: typeof speech === 'boolean' ? speech : DEFAULTS.speech,
    vibration: typeof vibration === 'boolean' ? vibration : DEFAULTS.vibration,
    shortcuts: typeof shortcuts === 'boolean' ? shortcuts : DEFAULTS.shortcuts,
    map: typeof map === 'boolean' ? map : DEFAULTS.map,
    boardPlan: typeof boardPlan === 'boolean' ? boardPlan : DEFAULTS.boardPlan,
    video: typeof video === 'boolean' ? video : DEFAULTS.video,
    videoQuality: isQuality(videoQuality) ? videoQuality : DEFAULTS.videoQuality,
    sightings: typeof sightings === 'boolean' ? sightings : DEFAULTS.sightings,
    wallQuality: isQuality(wallQuality) ? wallQuality : DEFAULTS.wallQuality,
    closedPanels: Array.isArray(closedPanels) ? closedPanels.filter(isPanel) : DEFAULTS.closedPanels,
    narrowPanel: isPanel(narrowPanel) ? narrowPanel : DEFAULTS.narrowPanel,
  };
}

export const preferences: Preferences = $state(read());

export function prefer(changes: Partial<Preferences>): void {
  Object.assign(preferences, changes);
  try {
    localStorage.setItem(PREFERENCES_KEY, JSON.stringify(preferences));
  } catch {
    // It then lasts as long as the page.
  }
  applyTheme();
}

const systemIsLight = window.matchMedia('(prefers-color-scheme: light)');
systemIsLight.addEventListener('change', applyTheme);
const systemWantsContrast = window.matchMedia('(prefers-contrast: more)');
systemWantsContrast.addEventListener('change', applyTheme);

/** The stylesheets read the theme from an attribute of the document, whether the system or the user chose it. */
export function applyTheme(): void {
  const { theme } = preferences;
  const ofSystem = systemWantsContrast.matches ? 'contrast' : systemIsLight.matches ? 'light' : 'dark';
  document.documentElement.dataset['theme'] = theme === 'system' ? ofSystem : theme;
  // The title bar of an installed console uses our colour; the page's static tags only cover the system's preference.
  const panel = getComputedStyle(document.documentElement).getPropertyValue('--panel').trim();
  for (const one of document.querySelectorAll<HTMLMetaElement>('meta[name="theme-color"]')) one.content = panel;
}
