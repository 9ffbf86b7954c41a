/** Strings that look like texts and are none: names that are the same in every language, and words of machines. */

/** In every file. */
const EVERYWHERE = new Set([
  'YYYY-MM-DD HH:MM',
  'YYYY-MM-DD HH:MM:SS',

  'Control Tower',
  'ArduPilot',
  'PX4',
  'Ctrl',
  'Escape',
  'Enter',
  'Polygon',
  'Point',
  'Feature',
]);

/** In one file, or in all of a folder (ends with a slash). True: none of its strings is a text. */
export const BY_PLACE = {
  // Names of parameters are the autopilot's, in English; so are the words they are made of.
  'parameters/abbreviations.ts': true,
  // Errors of programmers, and of parts that run in a worker and have no catalogue.
  'frames/definitions.ts': true,
  'link/field_types.ts': true,
  'parameters/facts.ts': ['no choice: {}', 'no line of facts, or the second one: {}'],
  'replay/replay_worker.ts': true,
  'video/mpeg1_decoder.ts': true,
  'video/player_worker.ts': true,
  'video/webgl_screen.ts': true,
  // Names of sticks, of severities, and of aims: read by programs.
  'kept_document.svelte.ts': ['tower.{}'],
  'link/page_alone.ts': ['warning', 'critical'],
  'link/sticks.ts': ['throttle', 'yaw', 'pitch', 'roll'],
  // What canvases and maps are told.
  'map/vector_style.ts': true,
  'map/drone_marker.ts': ['middle', 'left', 'round'],
  'plan/on_board.ts': ['on the drone'],
  'squad_mission.svelte.ts': ['on the drone'],
  'parameters/files.ts': ['Mission Planner'],
  // Keywords of file formats.
  'plan/formats/kml_plan.ts': ['{}<name>{}</name> {} </Document> </kml>'],
  // Names of browsers, systems and cameras.
  'words/browser_words.ts': ['Edge', 'Opera', 'Firefox', 'Safari', 'Android', 'Windows', 'Linux'],
  'parts/admin/MapLayerForm.svelte': ['{TileMatrix}, {TileCol}, {TileRow}'],
  // What the tower's audit trail keeps is in English, whoever wrote it.
  'parts/parameters/CopyDialog.svelte': ['parameters are copied'],
  'squad_action.svelte.ts': ['Hold of several drones', 'Return of several drones', 'Land of several drones'],
  // Names of edits, told apart by programs, and errors of programmers.
  'plan/drawing.ts': ['nudge {}'],
  'plan/plan_hash.ts': ['on the drone', 'A plan of {} items cannot be packed.'],
};

/** Fonts of canvases: `600 12px Inter`. */
const FONT = /^\d{3} \S*px |^\d+px /;

export function isException(path, shown) {
  const text = shown.trim();
  if (EVERYWHERE.has(text) || FONT.test(text)) return true;
  return Object.entries(BY_PLACE).some(
    ([place, which]) =>
      (path === place || (place.endsWith('/') && path.startsWith(place))) && (which === true || which.includes(text)),
  );
}
