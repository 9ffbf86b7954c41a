import { describe, expect, it } from 'vitest';

import { SCOPES, type Role } from '../../src/link/admin_types';
import { mayHaveScope, otherRoles, roleChip } from '../../src/words/role_words';

const ROLES: readonly Role[] = ['admin', 'operator', 'observer'];

describe('the role of an account', () => {
  it('is changed to another one', () => {
    for (const role of ROLES) expect([role, ...otherRoles(role)].sort()).toEqual([...ROLES].sort());
  });

  it('says what a token may be for', () => {
    const scopesOf = (role: Role): string => SCOPES.filter((scope) => mayHaveScope(role, scope)).join(' ');
    expect(ROLES.map(scopesOf)).toEqual(['watch fly admin metrics', 'watch fly', 'watch']);
  });

  it('stands beside the name of whoever is no operator', () => {
    expect(ROLES.map(roleChip)).toEqual(['admin', '', 'observer']);
  });
});
