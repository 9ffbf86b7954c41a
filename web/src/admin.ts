/** The requests of the account and admin pages, over the page's one connection. */

import { AccountRest } from './link/account_rest';
import { AdminRest } from './link/admin_rest';
import { TeamRest } from './link/team_rest';
import { askForProof } from './proof.svelte';
import { tower } from './tower.svelte';

tower.rest.onProofNeeded = askForProof;

export const accountRest = new AccountRest(tower.rest);
export const adminRest = new AdminRest(tower.rest);
export const teamRest = new TeamRest(tower.rest);
