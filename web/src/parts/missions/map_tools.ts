/** The map tools of the planner, with their keys and texts. */

import type { Tool } from '../../plan/drawing';

/** In the order of the tool bar. `key`: selects it anywhere on the page. */
export const TOOLS = [
  { tool: 'select', key: 'v', label: 'Select', words: 'Select and drag', icon: 'pointer' },
  { tool: 'item', key: 'w', label: 'Waypoint', words: 'Waypoints, one with each click', icon: 'waypoint' },
  { tool: 'survey', key: 's', label: 'Survey', words: 'Survey an area', icon: 'survey' },
  { tool: 'corridor', key: 'c', label: 'Corridor', words: 'Fly along a line, in lanes', icon: 'corridor' },
  { tool: 'orbit', key: 'o', label: 'Circle', words: 'Circle around a point', icon: 'orbit' },
  { tool: 'fence-polygon', key: 'f', label: 'Fence', words: 'Fence area', icon: 'fence' },
  { tool: 'rally', key: 'r', label: 'Rally', words: 'Rally points', icon: 'rally' },
  { tool: 'home', key: 'h', label: 'Home', words: 'Planned home', icon: 'home' },
] as const satisfies readonly { tool: Tool; key: string; label: string; words: string; icon: string }[];
