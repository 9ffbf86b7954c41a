/**
 * The requests of the account and admin pages, over the page's one connection. They may require a fresh proof of
 * identity.
 */

import { askForProof } from './proof.svelte';
import { tower } from './tower.svelte';

tower.rest.onProofNeeded = askForProof;

export const { rest } = tower;
