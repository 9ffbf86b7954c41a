/** Whether the page is as narrow or as low as a phone, where targets are larger (styles/base.css). */

import { MediaQuery } from 'svelte/reactivity';

const narrow = new MediaQuery('(max-width: 600px), (max-height: 500px)');

export const phone = {
  get isNarrow(): boolean {
    return narrow.current;
  },
};
