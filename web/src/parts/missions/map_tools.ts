/** The map tools of the planner, with their keys and texts. */

import { t } from '../../languages/text';
import type { Tool } from '../../plan/drawing';

/** In the order of the tool bar. `key`: selects it anywhere on the page. */
export const TOOLS = [
  { tool: 'select', key: 'v', label: t('Select'), words: t('Select and drag'), icon: 'pointer' },
  { tool: 'item', key: 'w', label: t('Waypoint'), words: t('Waypoints, one with each click'), icon: 'waypoint' },
  { tool: 'survey', key: 's', label: t('Survey'), words: t('Survey an area'), icon: 'survey' },
  { tool: 'corridor', key: 'c', label: t('Corridor'), words: t('Fly along a line, in lanes'), icon: 'corridor' },
  { tool: 'orbit', key: 'o', label: t('Circle'), words: t('Circle around a point'), icon: 'orbit' },
  { tool: 'fence-polygon', key: 'f', label: t('Fence'), words: t('Fence area'), icon: 'fence' },
  { tool: 'rally', key: 'r', label: t('Rally'), words: t('Rally points'), icon: 'rally' },
  { tool: 'home', key: 'h', label: t('Home'), words: t('Planned home'), icon: 'home' },
] as const satisfies readonly { tool: Tool; key: string; label: string; words: string; icon: string }[];
