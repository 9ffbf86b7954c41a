/** What an event of the audit trail adds to who, what and which drone. */

/** `name: value` pairs; an id is left out where its name stands beside it. */
export function detailWords(detail: Readonly<Record<string, unknown>>): string {
  return Object.entries(detail)
    .filter(([name]) => !(name.endsWith('_id') && name.slice(0, -'_id'.length) in detail))
    .map(
      ([name, value]) => `${name.replaceAll('_', ' ')}: ${typeof value === 'string' ? value : JSON.stringify(value)}`,
    )
    .join(', ');
}
