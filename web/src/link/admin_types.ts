/** Accounts and administration over REST. Times are ISO 8601 strings. */

import type { Schemas } from './rest_types';

export type NamedRef = Schemas['UserRefView'];
export type Role = Schemas['Role'];
export type Account = Schemas['AccountView'];
export type SecondFactor = Schemas['SecondFactorView'];
export type SecondFactorBegun = Schemas['SecondFactorBegun'];
export type Proof = Schemas['ProofView'];
export type Passkey = Schemas['PasskeyView'];
export type PasskeyAdded = Schemas['PasskeyAdded'];
export type PasswordJudgement = Schemas['PasswordJudgement'];
export type Session = Schemas['SessionView'];
export type Scope = Schemas['Scope'];
export type AlertChannel = Schemas['AlertChannelView'];
export type ApiToken = Schemas['TokenView'];
export type Loan = Schemas['LoanView'];
export type LoanTerms = Omit<Loan, 'user'>;
export type Enrolment = Schemas['EnrolmentView'];
export type EnrolmentState = Schemas['EnrolmentState'];
export type EnrolmentBegun = Schemas['EnrolmentWithToken'];
export type AuditEvent = Schemas['AuditEventView'];
export type Share = Schemas['SharedView'];
export type SystemHealth = Schemas['SystemView'];

export const SCOPES = ['watch', 'fly', 'admin', 'metrics'] as const satisfies readonly Scope[];
