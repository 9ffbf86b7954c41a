/** All texts about PX4's parameters. */

import { PX4 } from './px4';
import { PX4_FAMILIES } from './px4_families';

export const PX4_WORDS = [PX4, PX4_FAMILIES].join('\n');
