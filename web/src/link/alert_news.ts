/** Which alerts are news to this user, and are to be sounded and spoken: each once. Pure. */

import { byUrgency, needsSomebody, type Alert } from './alerts';

export class AlertNews {
  #known: ReadonlySet<string> = new Set();
  #isFirst = true;

  /** The whole list, after each change. Returns what is new, the worst first; at first only the worst of all. */
  look(all: readonly Alert[]): Alert[] {
    // A page that opens beside a squad in trouble must not recite everything.
    const open = byUrgency(all.filter((one) => needsSomebody(one) && one.severity !== 'notice'));
    const fresh = open.filter((one) => !this.#known.has(nameOf(one)));
    this.#known = new Set(all.map(nameOf));
    const found = this.#isFirst ? fresh.slice(0, 1) : fresh;
    if (all.length > 0) this.#isFirst = false;
    return found;
  }
}

/** An alert with other words is news again. */
const nameOf = ({ id, severity }: Alert): string => `${id}/${severity}`;
