/**
 * The texts of the console and their translations.
 *
 *     npm run texts           brings the files of each language up to date: adds new texts with an empty translation,
 *                             drops those that nobody uses, keeps the rest
 *     npm run texts:check     fails if a translation has faults; in a language that is offered, if one is lacking
 */

import { existsSync, mkdirSync, readdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

import { AREAS, collectMessages } from './texts/messages.mjs';
import { SOURCE } from './texts/source_tree.mjs';
import { faultsOf, isTranslated, offeredLanguages } from './texts/translations.mjs';

const LANGUAGES = ['pt'];
const folderOf = (language) => join(SOURCE, 'languages', language);

/** Every translation of a language, and the texts that two of its files have. */
function readLanguage(language) {
  const translations = new Map();
  const twice = [];
  const folder = folderOf(language);
  for (const file of existsSync(folder) ? readdirSync(folder).sort() : []) {
    if (!file.endsWith('.json')) continue;
    for (const [key, translation] of Object.entries(JSON.parse(readFileSync(join(folder, file), 'utf8')))) {
      if (translations.has(key)) twice.push(`${file}: "${key}" is in another file too`);
      translations.set(key, translation);
    }
  }
  return { translations, twice };
}

function write(messages) {
  for (const language of LANGUAGES) {
    const { translations } = readLanguage(language);
    mkdirSync(folderOf(language), { recursive: true });
    AREAS.forEach(([area], at) => {
      const keys = [...messages].filter(([, message]) => message.area === at).map(([key]) => key);
      const texts = Object.fromEntries(keys.sort().map((key) => [key, translations.get(key) ?? '']));
      writeFileSync(join(folderOf(language), `${area}.json`), `${JSON.stringify(texts, null, 2)}\n`);
    });
  }
}

/** What the tower writes (tower_texts.py): the keys are in the files themselves, so that only translations can be wrong. */
function checkTower(language) {
  const folder = join(folderOf(language), 'tower');
  const translations = new Map();
  for (const file of readdirSync(folder))
    for (const [key, words] of Object.entries(JSON.parse(readFileSync(join(folder, file), 'utf8'))))
      translations.set(key, words);
  const messages = new Map([...translations.keys()].map((key) => [key, { names: holesOf(key), isPlural: false }]));
  const lacking = [...translations].filter(([, words]) => words === '').map(([key]) => key);
  console.log(`${language}: ${translations.size - lacking.length} of ${translations.size} texts of the tower`);
  return [...faultsOf(language, messages, translations), ...lacking.map((key) => `${language}/tower: lacks "${key}"`)];
}

const holesOf = (key) => [...key.matchAll(/\{(\w+)(?::\w+)?\}/g)].map(([, name]) => name);

function check(messages) {
  const problems = [];
  const offered = offeredLanguages();
  for (const language of LANGUAGES) {
    const { translations, twice } = readLanguage(language);
    const lacking = [...messages.keys()].filter((key) => !isTranslated(translations.get(key)));
    problems.push(...twice.map((words) => `${language}/${words}`), ...faultsOf(language, messages, translations));
    if (offered.has(language)) problems.push(...lacking.map((key) => `${language}: lacks "${key}"`));
    if (offered.has(language)) problems.push(...checkTower(language));
    console.log(`${language}: ${messages.size - lacking.length} of ${messages.size} texts, ${lacking.length} lacking`);
  }
  return problems;
}

const { messages, problems } = collectMessages();
if (process.argv.includes('--check')) problems.push(...check(messages));
else write(messages);
for (const problem of problems) console.error(problem);
process.exitCode = problems.length > 0 ? 1 : 0;
