/** The one ground of this page: its tiles are shared by planner, map and instruments. */

import { tower } from '../tower.svelte';
import { Ground } from './ground.svelte';

let made: Ground | null = null;

export const theGround = (): Ground => (made ??= new Ground(tower.rest));
