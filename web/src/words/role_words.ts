/** Texts about the role of an account and its rights. */

import { t } from '../languages/text';
import type { Role, Scope } from '../link/admin_types';

export const ACCOUNT_ROLES: Record<Role, { readonly noun: string; readonly does: string }> = {
  observer: { noun: t('an observer'), does: t('Sees the drones that they are given, and never flies.') },
  operator: { noun: t('an operator'), does: t('Sees and flies the drones that they own or that are lent to them.') },
  admin: { noun: t('an admin'), does: t('Sees and may fly every drone, and administers the tower.') },
};

const SCOPES_OF: Record<Role, readonly Scope[]> = {
  observer: ['watch'],
  operator: ['watch', 'fly'],
  admin: ['watch', 'fly', 'admin', 'metrics'],
};

/** The roles that an account may change to, from the strongest to the weakest. */
export const otherRoles = (role: Role): Role[] =>
  (['admin', 'operator', 'observer'] as const).filter((other) => other !== role);

/** Whether an API token of such an account may have this scope. */
export const mayHaveScope = (role: Role, scope: Scope): boolean => SCOPES_OF[role].includes(scope);

/** The label beside the name; empty for operators, the most common role. */
export const roleChip = (role: Role): string => (role === 'operator' ? '' : role);
