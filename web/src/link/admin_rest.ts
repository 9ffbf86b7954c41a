/** Requests that only admins may make: users, drones and who may use them, enrolment, the audit trail, the system. */

import type {
  Account,
  AuditEvent,
  AuditFilters,
  Enrolment,
  EnrolmentBegun,
  LoanTerms,
  Role,
  SystemHealth,
} from './admin_types';
import { readDrone, type DroneOnWire } from './drone_view';
import type { Rest } from './rest';
import type { Drone } from './wire_types';

export interface UserChanges {
  readonly role?: Role;
  readonly disabled?: boolean;
  readonly password?: string;
}

/** The part of an address after `?`; filters that are empty are left out. */
export function auditQuery(filters: AuditFilters, page: { limit?: number; before?: number } = {}): string {
  const query = new URLSearchParams();
  for (const [name, value] of Object.entries({ ...filters, ...page })) {
    if (value !== undefined && value !== '') query.set(name, String(value));
  }
  return query.toString();
}

export class AdminRest {
  readonly #rest: Rest;

  constructor(rest: Rest) {
    this.#rest = rest;
  }

  users(): Promise<Account[]> {
    return this.#rest.call('GET', '/users');
  }

  createUser(name: string, password: string, role: Role): Promise<Account> {
    return this.#rest.call('POST', '/users', { name, password, role });
  }

  changeUser(userId: number, changes: UserChanges): Promise<Account> {
    return this.#rest.call('PATCH', `/users/${userId}`, changes);
  }

  deleteUser(userId: number): Promise<void> {
    return this.#rest.call('DELETE', `/users/${userId}`);
  }

  removeSecondFactorOf(userId: number): Promise<Account> {
    return this.#rest.call('DELETE', `/users/${userId}/second-factor`);
  }

  /** No agent can sign in as it before one has been enrolled. */
  async createDrone(name: string): Promise<Drone> {
    return readDrone((await this.#rest.call<{ drone: DroneOnWire }>('POST', '/drones', { name })).drone);
  }

  async renameDrone(droneId: number, name: string): Promise<Drone> {
    return readDrone(await this.#rest.call<DroneOnWire>('PATCH', `/drones/${droneId}`, { name }));
  }

  deleteDrone(droneId: number): Promise<void> {
    return this.#rest.call('DELETE', `/drones/${droneId}`);
  }

  /** The link of its agent ends at once; it has to be enrolled anew. */
  async revokeKey(droneId: number): Promise<Drone> {
    return readDrone(await this.#rest.call<DroneOnWire>('DELETE', `/drones/${droneId}/key`));
  }

  addOwner(droneId: number, userId: number): Promise<unknown> {
    return this.#rest.call('PUT', `/drones/${droneId}/owners/${userId}`);
  }

  removeOwner(droneId: number, userId: number): Promise<unknown> {
    return this.#rest.call('DELETE', `/drones/${droneId}/owners/${userId}`);
  }

  lend(droneId: number, userId: number, terms: LoanTerms): Promise<unknown> {
    return this.#rest.call('PUT', `/drones/${droneId}/loans/${userId}`, terms);
  }

  endLoan(droneId: number, userId: number): Promise<unknown> {
    return this.#rest.call('DELETE', `/drones/${droneId}/loans/${userId}`);
  }

  enrolments(): Promise<Enrolment[]> {
    return this.#rest.call('GET', '/enrolments');
  }

  /** `autopilot`: where the agent finds it, as docs/agent.md spells it; empty: the agent is started by hand later. */
  enrol(droneId: number, lastsS: number, autopilot: string): Promise<EnrolmentBegun> {
    return this.#rest.call('POST', `/drones/${droneId}/enrolments`, { lasts_s: lastsS, autopilot });
  }

  cancelEnrolment(enrolmentId: number): Promise<void> {
    return this.#rest.call('DELETE', `/enrolments/${enrolmentId}`);
  }

  audit(filters: AuditFilters, limit: number, before?: number): Promise<AuditEvent[]> {
    const page = before === undefined ? { limit } : { limit, before };
    return this.#rest.call('GET', `/audit?${auditQuery(filters, page)}`);
  }

  system(): Promise<SystemHealth> {
    return this.#rest.call('GET', '/system');
  }
}

/** Where the browser downloads the audit trail from, as CSV. */
export function auditCsvHref(filters: AuditFilters): string {
  const query = auditQuery(filters);
  return `/api/v1/audit.csv${query ? `?${query}` : ''}`;
}
