/** Teams over REST, as docs/teams.md and docs/api.md define them: people and drones that belong together. */

import type { NamedRef } from './admin_types';
import type { Rest } from './rest';

export const TEAM_ROLES = ['observer', 'operator', 'admin'] as const;
export type TeamRole = (typeof TEAM_ROLES)[number];

export interface Member {
  readonly user: NamedRef;
  readonly role: TeamRole;
}

/** Somebody was invited by this name; whether anybody has it, the tower does not say. */
export interface Invitation {
  readonly id: number;
  readonly name: string;
  readonly role: TeamRole;
  readonly expires_at: string;
}

export interface Team {
  readonly id: number;
  readonly name: string;
  /** One's own; null for an admin of the tower who is not in it. */
  readonly role: TeamRole | null;
  readonly members: readonly Member[];
  readonly drones: readonly NamedRef[];
  readonly invitations: readonly Invitation[];
}

/** An invitation as the invited person reads it. */
export interface Received {
  readonly id: number;
  readonly team: string;
  readonly role: TeamRole;
  readonly invited_by: string;
  readonly expires_at: string;
}

export class TeamRest {
  readonly #rest: Rest;

  constructor(rest: Rest) {
    this.#rest = rest;
  }

  teams(): Promise<Team[]> {
    return this.#rest.call('GET', '/teams');
  }

  make(name: string): Promise<Team> {
    return this.#rest.call('POST', '/teams', { name });
  }

  rename(teamId: number, name: string): Promise<Team> {
    return this.#rest.call('PATCH', `/teams/${teamId}`, { name });
  }

  delete(teamId: number): Promise<void> {
    return this.#rest.call('DELETE', `/teams/${teamId}`);
  }

  setRole(teamId: number, userId: number, role: TeamRole): Promise<Team> {
    return this.#rest.call('PUT', `/teams/${teamId}/members/${userId}`, { role });
  }

  removeMember(teamId: number, userId: number): Promise<void> {
    return this.#rest.call('DELETE', `/teams/${teamId}/members/${userId}`);
  }

  addDrone(teamId: number, droneId: number): Promise<Team> {
    return this.#rest.call('PUT', `/teams/${teamId}/drones/${droneId}`);
  }

  removeDrone(teamId: number, droneId: number): Promise<void> {
    return this.#rest.call('DELETE', `/teams/${teamId}/drones/${droneId}`);
  }

  invite(teamId: number, name: string, role: TeamRole): Promise<Invitation> {
    return this.#rest.call('POST', `/teams/${teamId}/invitations`, { name, role });
  }

  withdraw(teamId: number, invitationId: number): Promise<void> {
    return this.#rest.call('DELETE', `/teams/${teamId}/invitations/${invitationId}`);
  }

  received(): Promise<Received[]> {
    return this.#rest.call('GET', '/me/invitations');
  }

  accept(invitationId: number): Promise<Team> {
    return this.#rest.call('POST', `/me/invitations/${invitationId}/accept`);
  }

  decline(invitationId: number): Promise<void> {
    return this.#rest.call('POST', `/me/invitations/${invitationId}/decline`);
  }
}
