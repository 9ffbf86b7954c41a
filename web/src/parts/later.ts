/** Parts of the console that a first visit does not show: they load when the console is idle, or when first needed. */

export const later = {
  confirmDialog: () => import('./ConfirmDialog.svelte'),
  controlActions: () => import('../control_actions'),
  droneCard: () => import('./DroneCard.svelte'),
  journalList: () => import('./JournalList.svelte'),
  pairsList: () => import('./PairsList.svelte'),
  proofDialog: () => import('./ProofDialog.svelte'),
  squadRowCompact: () => import('./SquadRowCompact.svelte'),
  squadActionDialog: () => import('./SquadActionDialog.svelte'),
  squadTable: () => import('./SquadTable.svelte'),
  searchDialog: () => import('./SearchDialog.svelte'),
  helpSheet: () => import('./HelpSheet.svelte'),
  viewsMenu: () => import('./ViewsMenu.svelte'),
};

/** In advance: nothing of them may be missing after an update of the tower. A part that fails is tried again later. */
export function loadLater(): void {
  for (const part of Object.values(later)) void part().catch(() => undefined);
}
