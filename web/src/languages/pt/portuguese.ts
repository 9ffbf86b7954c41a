/** The Portuguese catalogue: all files of this folder as one. A part of its own, which only its readers fetch. */

import type { Catalogue } from '../text';
import type { TowerTexts } from '../tower_text';

const files = import.meta.glob<Catalogue>('./*.json', { eager: true, import: 'default' });

const ofTheTower = import.meta.glob<TowerTexts>('./tower/*.json', { eager: true, import: 'default' });

/** What the tower and its agents write in English. */
export const tower: TowerTexts = Object.assign({}, ...Object.values(ofTheTower)) as TowerTexts;

export default Object.assign({}, ...Object.values(files)) as Catalogue;
