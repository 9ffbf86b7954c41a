/** Teams over REST (docs/teams.md): groups of people and drones. */

import type { Schemas } from './rest_types';

export type TeamRole = Schemas['TeamRole'];
export type Member = Schemas['MemberView'];
export type Invitation = Schemas['InvitationView'];
export type Team = Schemas['TeamView'];
/** An invitation as the invited person sees it. */
export type Received = Schemas['ReceivedView'];

export const TEAM_ROLES = ['observer', 'operator', 'admin'] as const satisfies readonly TeamRole[];
