/** A browser's own identification in recognisable words: "Firefox on Windows". */

import { t } from '../languages/text';

const BROWSERS: readonly (readonly [RegExp, string])[] = [
  [/\bEdg\//, 'Edge'],
  [/\bOPR\//, 'Opera'],
  [/\bFirefox\//, 'Firefox'],
  [/\b(?:Headless)?Chrom(?:e|ium)\//, t('Chromium or Chrome')],
  [/\bSafari\//, 'Safari'],
];
const SYSTEMS: readonly (readonly [RegExp, string])[] = [
  [/\bAndroid\b/, 'Android'],
  [/\b(?:iPhone|iPad)\b/, 'iOS'],
  [/\bWindows\b/, 'Windows'],
  [/\bMac OS X\b/, 'macOS'],
  [/\bCrOS\b/, 'ChromeOS'],
  [/\bLinux\b/, 'Linux'],
];

export function browserWords(userAgent: string): string {
  const found = (table: readonly (readonly [RegExp, string])[]): string =>
    table.find(([pattern]) => pattern.test(userAgent))?.[1] ?? '';
  const browser = found(BROWSERS);
  const system = found(SYSTEMS);
  if (browser && system) return t('{browser} on {system}', { browser, system });
  return browser || userAgent.slice(0, 40) || t('a program that does not say its name');
}
