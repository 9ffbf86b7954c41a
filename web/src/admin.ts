/** The requests of the account and admin pages, over the page's one connection. */

import { AccountRest } from './link/account_rest';
import { AdminRest } from './link/admin_rest';
import { tower } from './tower.svelte';

export const accountRest = new AccountRest(tower.rest);
export const adminRest = new AdminRest(tower.rest);
