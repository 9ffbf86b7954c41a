/** The Portuguese catalogue: all files of this folder as one. A part of its own, which only its readers fetch. */

import type { Catalogue } from '../text';

const files = import.meta.glob<Catalogue>('./*.json', { eager: true, import: 'default' });

export default Object.assign({}, ...Object.values(files)) as Catalogue;
