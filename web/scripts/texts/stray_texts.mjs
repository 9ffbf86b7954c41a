/**
 * Finds texts for the screen in the source: in markup, in attributes that are read, and in strings that are sentences or
 * words for people. What machines read (ids, classes, keys, addresses, units, names of messages) is told apart by where
 * it stands and what it looks like. The rules are a judgement; exceptions.mjs lists what they judge wrongly.
 */

import { isException } from './exceptions.mjs';
import { endOf, startOf, treesOf, walk } from './source_tree.mjs';

/** Attributes and properties whose value people read. */
const SHOWN_ATTRIBUTES = new Set(
  `title aria-label aria-description aria-valuetext aria-roledescription placeholder alt label lead hint closes empty
  emptyWords about problem fault words note notice button`.split(/\s+/),
);
const NOT_SHOWN_ATTRIBUTES =
  /^(class|style|id|type|role|href|for|name|key|value|autocomplete|transform|d|data-.*|test[iI]d|.*Testid|fieldId|aria-(?!label|desc|valuetext|role).*|points|path|viewBox|download)$/;
const SHOWN_KEYS =
  /^(choices|label|title|words|detail|text|said|badge|verb|does|lead|hint|now|next|why|note|doing|confirmLabel|reasonLabel|checkLabel|.*Words)$/;
const NOT_SHOWN_KEYS =
  /^(type|path|id|key|testid|.*Testid|method|icon|url|codec|unit|symbol|part|format|source|Accept|Range|'?Content-Type'?|class|part|fragment|vertex)$/;
const SHOWN_NAMES = /(WORDS|LABELS|NAMES|TITLES|TEXTS|[wW]ords|Text|Label|Title|Brief|Sentence|Phrase)$/;
/** Functions whose arguments machines read. */
const MACHINE_CALLS =
  /(^|\.)(querySelector(All)?|closest|matches|getElementsByTagName|setProperty|getPropertyValue|setRequestHeader|setAttribute|getContext|addEventListener|removeEventListener|RegExp|URL|Worker|matchMedia|MediaQuery|startsWith|endsWith|includes|indexOf|split|newest|encode|colour|haloText|Error\.prototype|getItem|setItem|removeItem|createElement(NS)?|get|has|parseFromString)$/;

const isString = (node) => node.type === 'Literal' && typeof node.value === 'string';
/** The text of a literal, with `{}` for each expression in it. */
export const shownOf = (node) =>
  isString(node)
    ? node.value
    : node.quasis.map(({ value }, at) => value.cooked + (at < node.expressions.length ? '{}' : '')).join('');

const PROSE =
  /^[,:;.]? [a-z]{2}|[A-Za-z]{2,}[,:;.…]? +[A-Za-z({"“]|\{\}(’s|'s)?[,:;.]? [a-z]{2}|[a-z]{2}[.:…]?"? ?\{|^[^{}]*[a-z]{2,}\.( |$)/;
const CAPITALISED = /^[A-Z][a-z]+([-/][A-Za-z]+)*([ .…:!?,]|$)/;
const UNITS =
  /^(m|ft|km|mi|s|ms|min|h|d|V|A|Ah|mAh|Wh|W|kW|g|kg|px|mm|cm|Hz|kHz|MHz|kB|MB|GB|TB|B|kB\/s|kbit\/s|Mbit\/s|m\/s|m\/s²|ha|cm|pixel|km²|km\/h|deg|deg\/s|rad|AMSL|GPS|UTC|UDP|RTK|PX4|MAVLink|ArduPilot|x|y|z|n|N|E|S|W|NE|SE|SW|NW|Z|R)$/;

/** Whether anything but units and signs is left. */
export const hasWords = (shown) =>
  shown
    .replaceAll('{}', ' ')
    .split(/[^A-Za-z0-9/²]+/)
    .some((word) => /[A-Za-z]{2}|^[aAI]$/.test(word) && !UNITS.test(word) && /[A-Za-z]/.test(word));

const looksLikeCode = (shown) =>
  /^[a-z]+([A-Z][a-z0-9]*)+$|^[\w{}-]+[_/][\w{}/_-]+$|^[a-z{}0-9]+(-[a-z{}0-9]+)+$|^--|^#|^\.|^https?:|^\/|^[A-Z0-9]+(_[A-Z0-9]+)+$|^<|^[a-z]+\.[a-z]|^application\/|px\b|^rgba?\(|^\[|\b\d{3} \{?\}?\d*px|^M[\d. -]/.test(
    shown,
  );

const nameOfKey = (property) => property.key.name ?? String(property.key.value ?? '');
const calleeOf = (call, code) => code.slice(startOf(call.callee), endOf(call.callee)).replace(/[?!]/g, '');

/** Whether the parent shows that a machine compares, imports or looks up this string. */
function isForMachines(node, ancestors, code) {
  const parent = ancestors.at(-1);
  if (parent.type === 'BinaryExpression' && /=|in/.test(parent.operator)) return true;
  if (parent.type === 'SwitchCase' || parent.type === 'TaggedTemplateExpression') return true;
  if (parent.type === 'MemberExpression') return parent.property === node;
  if (parent.type === 'Property' && parent.key === node && parent.value !== node) return true;
  if (parent.type === 'PropertyDefinition' && parent.key === node) return true;
  const ofCall = /^(Call|New)Expression$/.test(parent.type) && parent.callee !== node;
  return ofCall && MACHINE_CALLS.test(calleeOf(parent, code));
}

/** Where a string stands: in an attribute that is read, in a table of words, in a function that returns words… */
function isShownPlace(node, ancestors) {
  let child = node;
  for (const above of [...ancestors].reverse()) {
    if (above.type === 'ExpressionTag') {
      const holder = ancestors[ancestors.indexOf(above) - 1];
      return holder?.type === 'Fragment' || (holder?.type === 'Attribute' && SHOWN_ATTRIBUTES.has(holder.name));
    }
    if (above.type === 'ConditionalExpression') {
      if (above.test === child) return false;
    } else if (above.type === 'Property') {
      const key = nameOfKey(above);
      if (NOT_SHOWN_KEYS.test(key)) return false;
      if (SHOWN_KEYS.test(key)) return true;
    } else if (above.type === 'VariableDeclarator') {
      return SHOWN_NAMES.test(above.id.name ?? '');
    } else if (/Function/.test(above.type) && above.id) {
      return SHOWN_NAMES.test(above.id.name);
    } else if (
      /^(Call|New|Member|Binary)Expression$/.test(above.type) &&
      !(above.type === 'BinaryExpression' && above.operator === '+')
    ) {
      if (!(above.type === 'CallExpression' && above.callee !== child && /^(t|plural)$/.test(above.callee.name ?? '')))
        return false;
    }
    child = above;
  }
  return false;
}

const isCatalogueCall = (node) => node?.type === 'CallExpression' && /^(t|tAs|plural)$/.test(node.callee.name ?? '');

/** In a table, or in a list of pairs, whose other entries are texts of the catalogue. */
function isBesideTexts(node, ancestors) {
  const [table, holder] = [ancestors.at(-2), ancestors.at(-1)];
  if (holder?.type === 'Property' && table?.type === 'ObjectExpression') {
    const others = table.properties.filter((one) => one !== holder);
    return others.length > 1 && others.every((one) => isCatalogueCall(one.value) && !SHOWN_KEYS.test(nameOfKey(one)));
  }
  if (holder?.type !== 'ArrayExpression' || table?.type !== 'ArrayExpression') return false;
  const at = holder.elements.indexOf(node);
  return table.elements.some((one) => one !== holder && isCatalogueCall(one?.elements?.[at]));
}

function isTextLiteral(node, ancestors, code, path) {
  const shown = shownOf(node);
  if (!/[a-z]{2}|[A-Z]{2}|\b[aA]\b/i.test(shown.replaceAll('{}', '')) || !hasWords(shown)) return false;
  if (isException(path, shown) || isForMachines(node, ancestors, code)) return false;
  const attribute = ancestors.findLast(({ type }) => type === 'Attribute');
  if (attribute && NOT_SHOWN_ATTRIBUTES.test(attribute.name)) return false;
  if (ancestors.some(({ type }) => /Directive$/.test(type) && type !== 'OnDirective')) return false;
  const property = ancestors.at(-1).type === 'Property' ? nameOfKey(ancestors.at(-1)) : '';
  if (isString(node) && looksLikeCode(shown)) return false;
  if (!isString(node) && looksLikeCode(shown) && !/[a-z]{2} [a-z{]/.test(shown)) return false;
  if (isBesideTexts(node, ancestors)) return true;
  if (PROSE.test(shown)) return !NOT_SHOWN_KEYS.test(property);
  if (CAPITALISED.test(shown)) return !NOT_SHOWN_KEYS.test(property);
  return isShownPlace(node, ancestors) && !NOT_SHOWN_KEYS.test(property);
}

/** The first argument of `t`, and the forms of `plural`: texts that are in the catalogue. */
export function isCatalogued(ancestors, node) {
  const at = ancestors.findLastIndex(
    ({ type, callee }) => type === 'CallExpression' && /^(t|tAs|plural)$/.test(callee.name ?? ''),
  );
  if (at < 0) return false;
  const call = ancestors[at];
  const way = [...ancestors.slice(at + 1), node];
  if (call.callee.name === 't') return way[0] === call.arguments[0];
  if (call.callee.name === 'tAs') return call.arguments.indexOf(way[0]) < 2;
  return way[0] === call.arguments[1];
}

/** Types and imports hold no texts. */
export const holdsNoText = (node) =>
  (/^TS(Type|Interface|Literal|Union|Array|Function|Enum)/.test(node.type) && node.type !== 'TSTypeAssertion') ||
  node.type === 'ImportDeclaration' ||
  node.type === 'ImportExpression' ||
  node.type === 'ExportAllDeclaration' ||
  (node.type === 'ExportNamedDeclaration' && Boolean(node.source));

const isLetterRun = (nodes) => hasWords(nodes.map((one) => (one.type === 'Text' ? one.data : '{}')).join(''));
/** Elements whose content is code. */
const CODE_ELEMENTS = /^(code|pre|kbd|samp|style|script)$/;

/** Runs of text and expressions beside one another that hold words. */
function runsOf(fragment, path) {
  const runs = [];
  let run = [];
  const end = () => {
    if (run.some(({ type }) => type === 'Text') && isLetterRun(run)) {
      const shown = run
        .map((one) => (one.type === 'Text' ? one.data : '{}'))
        .join('')
        .replace(/\s+/g, ' ')
        .trim();
      if (!isException(path, shown)) runs.push(run);
    }
    run = [];
  };
  for (const node of fragment.nodes) {
    if (node.type === 'Text' || node.type === 'ExpressionTag') run.push(node);
    else if (node.type !== 'Comment') end();
  }
  end();
  return runs;
}

/**
 * The texts of one file that are not in the catalogue.
 * Each: `kind` ('run', 'attribute' or 'literal'), `nodes`, `start`, `end`, `shown`.
 */
export function strayTexts(path, code) {
  const found = [];
  const add = (kind, nodes, shown, ancestors) =>
    found.push({
      kind,
      nodes,
      ancestors,
      start: startOf(nodes[0]),
      end: endOf(nodes.at(-1)),
      shown: shown.replace(/\s+/g, ' ').trim(),
    });
  for (const tree of treesOf(path, code)) {
    walk(tree, (node, ancestors) => {
      if (holdsNoText(node)) return false;
      if (node.type === 'Fragment') {
        const holder = ancestors.at(-1);
        if (!(holder?.type === 'RegularElement' && CODE_ELEMENTS.test(holder.name)))
          for (const run of runsOf(node, path)) add('run', run, run.map((one) => one.data ?? '{}').join(''), ancestors);
      } else if (node.type === 'Attribute' && Array.isArray(node.value) && SHOWN_ATTRIBUTES.has(node.name)) {
        const shown = node.value.map((one) => one.data ?? '{}').join('');
        if (node.value.some(({ type }) => type === 'Text') && hasWords(shown) && !isException(path, shown))
          add('attribute', node.value, shown, ancestors);
      } else if (isString(node) || node.type === 'TemplateLiteral') {
        if (ancestors.length > 0 && !isCatalogued(ancestors, node) && isTextLiteral(node, ancestors, code, path))
          add('literal', [node], shownOf(node), ancestors);
      }
      return true;
    });
  }
  return found;
}
