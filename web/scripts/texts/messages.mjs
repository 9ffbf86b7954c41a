/** The texts of the source that are in the catalogue, with the place of their first use. */

import { lineAt, readSource, sourceFiles, startOf, treesOf, walk } from './source_tree.mjs';

/** The files of a language, and whose texts they hold: by the first area, in this order, that uses a text. */
export const AREAS = [
  ['words', [/^(words|link|values|search|map|terrain)\//]],
  [
    'flight',
    [/^[^/]+$/, /^parts\/[^/]+$/, /^parts\/values\//, /^design\//, /^pages\/(Control|Monitor|NoConnection|SignIn)/],
  ],
  ['plan', [/^(plan|squad)\//, /^parts\/(missions|squad_mission)\//, /^pages\/(Missions|SquadMission|Zones)/]],
  ['account', [/^parts\/(account|admin|teams)\//, /^pages\/(Account|Admin|First)/]],
  ['setup', [/^(setup|parameters)\//, /^parts\/(setup|parameters)\//, /^pages\/(Setup|Parameters|Logs)/]],
  ['records', [/./]],
];
const areaOf = (path) => AREAS.findIndex(([, patterns]) => patterns.some((pattern) => pattern.test(path)));

/** A text written as one literal, or null. */
function literalOf(node) {
  if (node?.type === 'Literal' && typeof node.value === 'string') return node.value;
  if (node?.type === 'TemplateLiteral' && node.expressions.length === 0) return node.quasis[0].value.cooked;
  return null;
}

const namesIn = (message) => [...message.matchAll(/\{(\w+)\}/g)].map(([, name]) => name);

/** `key`, `names` of its values, and `one`, the English singular, if it counts. Null for other calls. */
function messageOf(call) {
  const [first, second] = call.arguments;
  if (call.callee.name === 't') return { key: literalOf(first) };
  if (call.callee.name === 'tAs') return { key: `${literalOf(second)} [[${literalOf(first)}]]` };
  if (call.callee.name !== 'plural' || second?.type !== 'ObjectExpression') return null;
  const form = (name) => literalOf(second.properties.find(({ key }) => key?.name === name)?.value);
  return { key: form('other'), one: form('one') };
}

/** All messages by key: `{ area, places, names, isPlural, one }`, and what cannot be collected, in words. */
export function collectMessages() {
  const messages = new Map();
  const problems = [];
  for (const path of sourceFiles()) {
    const code = readSource(path);
    for (const tree of treesOf(path, code))
      walk(tree, (node) => {
        const message = node.type === 'CallExpression' ? messageOf(node) : null;
        if (!message) return;
        const place = `${path}:${lineAt(code, startOf(node))}`;
        if (message.key === null || message.one === null) problems.push(`${place}: the text is not one literal`);
        else note(message, path, place);
      });
  }
  function note({ key, one }, path, place) {
    const isPlural = one !== undefined;
    const known = messages.get(key) ?? { area: Infinity, places: [], names: namesIn(key), isPlural, one };
    if (known.isPlural !== isPlural) problems.push(`${place}: "${key}" counts here and not elsewhere`);
    known.area = Math.min(known.area, areaOf(path));
    known.places.push(place);
    messages.set(key, known);
  }
  return { messages, problems };
}
