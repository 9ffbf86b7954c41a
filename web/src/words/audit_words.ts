/** Events of the audit trail as sentences: what follows the name of whoever did it. */

import { t } from '../languages/text';
import { dateMinute } from './dates';

type Detail = Readonly<Record<string, unknown>>;

const MOMENT = /^\d{4}-\d\d-\d\dT\d\d:\d\d/;

/** Says nothing to a person: the log and the CSV have it. */
const FOR_PROGRAMS: ReadonlySet<string> = new Set([
  'epoch',
  'took_ms',
  'operation',
  'hash',
  'fingerprint',
  'way',
  'sender',
  'session_id',
  'enrolment_id',
  'alert',
  'task',
  'first_point',
  'holder',
  'assistant',
]);

/** The kinds of actions by which the trail is filtered, with the first word of their names. */
export const ACTION_KINDS: readonly (readonly [kind: string, words: string])[] = [
  ['control', t('Control')],
  ['hold', t('Holds')],
  ['command', t('Commands')],
  ['operation', t('Plans, parameters, following')],
  ['drone', t('Drones')],
  ['enrolment', t('Enrolments')],
  ['separation', t('Separation')],
  ['alert', t('Alerts')],
  ['preflight', t('Checks before flight')],
  ['checklist', t('Checklists')],
  ['maintenance', t('Maintenance')],
  ['mission', t('Mission library')],
  ['zone', t('Zones')],
  ['recording', t('Recordings')],
  ['flight', t('Flights')],
  ['map', t('Maps')],
  ['session', t('Sign-ins')],
  ['user', t('Accounts')],
  ['passkey', t('Passkeys')],
  ['token', t('Tokens')],
  ['team', t('Teams')],
  ['share', t('Shares')],
  ['tower', t('Tower')],
];

/** The details of one event. It remembers which the sentence has used. */
class Told {
  readonly #detail: Detail;
  readonly #used = new Set<string>();

  constructor(detail: Detail) {
    this.#detail = detail;
  }

  /** The value in words, or "" without one. */
  text(name: string): string {
    this.#used.add(name);
    this.#used.add(`${name}_id`);
    const value = this.#detail[name];
    return value === null || value === undefined ? '' : valueWords(value);
  }

  is(name: string, value: unknown): boolean {
    return this.#detail[name] === value;
  }

  rest(): Detail {
    const left = Object.entries(this.#detail).filter(
      ([name]) => !this.#used.has(name) && !FOR_PROGRAMS.has(name) && !(name === 'result' && this.is('result', 'done')),
    );
    return Object.fromEntries(left);
  }
}

type Sentence = (told: Told) => string;

/** Those of the controls: the rest of the sentence where it was refused says why. */
const CONTROL: Readonly<Record<string, Sentence>> = {
  acquire: () => t('took control'),
  release: () => t('released control'),
  take: (told) => {
    const from = told.text('taken_from');
    return from === '' ? t('took control as an admin') : t('took control from {name}', { name: from });
  },
  give: (told) => t('gave control back to {name}', { name: told.text('taken_from') || t('nobody') }),
  accept: () => t('accepted control'),
  assist: () => t('began to assist'),
  'assist-end': () => t('ended the assistance'),
  turn: () => t('passed the turn to fly'),
  revoke: () => t('ended control: the right to it is gone'),
  forget: () => t('ended the right to get control back'),
  'offer-lapsed': () => t('ended the offer of control: nobody accepted it'),
  expire: () => t('ended control: the holder did not come back'),
};

const SENTENCES: Readonly<Record<string, Sentence>> = {
  'control.holder_gone': (told) =>
    t('held: the holder has been gone for {seconds} s', { seconds: told.text('gone_s') }),
  'control.round_trip_too_long': (told) => t('held: the round trip takes {ms} ms', { ms: told.text('rtt_ms') }),
  'control.loan_limit': (told) => t('held at the limit of a loan: {why}', { why: told.text('why') }),
  'control.zone': (told) => t('held at the zone {zone}: {why}', { zone: told.text('zone'), why: told.text('why') }),
  'control.stick_gesture': (told) =>
    told.is('airborne', true)
      ? t('held back sticks that would have stopped the motors in the air')
      : t('held back sticks that would have armed or disarmed'),
  'control.stay': () => t('chose that it stays where it is'),
  'hold.confirmed': (told) => t('confirmed the hold in {mode}', { mode: told.text('mode') }),
  'hold.not_needed': () => t('reported that no hold was needed'),
  'hold.unconfirmed': () => t('could not confirm the hold'),
  'command.given': (told) => {
    const how = { command: told.text('command'), result: told.text('result') };
    return t('commanded {command}: {result}', how);
  },
  'operation.began': (told) => t('began: {work}', { work: workWords(told) }),
  'operation.ended': (told) => {
    const end = { work: workWords(told), words: told.text('words') || told.text('state') };
    told.text('state');
    return t('ended: {work}: {words}', end);
  },
  'separation.warning': (told) => t('came near another drone in {seconds} s', { seconds: told.text('in_s') }),
  'alert.acknowledged': (told) => {
    told.text('rule');
    return t('acknowledged the alert “{words}”', { words: told.text('words') });
  },
  'preflight.signed': () => t('signed the check before flight'),
  'checklist.changed': () => t('changed the checklist'),
  'maintenance.added': (told) => t('added the maintenance “{title}”', { title: told.text('title') }),
  'maintenance.done': (told) => t('did the maintenance “{title}”', { title: told.text('title') }),
  'maintenance.changed': (told) => t('changed the maintenance “{title}”', { title: told.text('title') }),
  'maintenance.removed': (told) => t('removed the maintenance “{title}”', { title: told.text('title') }),
  'mission.created': (told) => t('put “{mission}” into the library', { mission: told.text('mission') }),
  'mission.changed': (told) => t('changed “{mission}” in the library', { mission: told.text('mission') }),
  'mission.deleted': (told) => t('deleted “{mission}” from the library', { mission: told.text('mission') }),
  'zone.created': (told) => t('drew the zone {zone}', { zone: told.text('zone') }),
  'zone.changed': (told) => t('changed the zone {zone}', { zone: told.text('zone') }),
  'zone.deleted': (told) => t('deleted the zone {zone}', { zone: told.text('zone') }),
  'recording.began': () => t('began to record the video'),
  'recording.ended': () => t('ended the recording of the video'),
  'recording.deleted': () => t('deleted a recording'),
  'recording.removed': () => t('removed a recording to make room'),
  'flight.imported': (told) => t('imported the flight {name}', { name: told.text('name') }),
  'flight.import_deleted': (told) => t('deleted the imported flight {name}', { name: told.text('name') }),
  'flight.deleted': () => t('deleted a flight'),
  'flight.removed': () => t('removed a flight to make room'),
  'map.file_added': (told) => t('added the map file {file}', { file: told.text('file') }),
  'map.file_removed': (told) => t('removed the map file {file}', { file: told.text('file') }),
  'map.layer_added': (told) => t('added the map layer {layer}', { layer: told.text('layer') }),
  'map.layer_removed': (told) => t('removed the map layer {layer}', { layer: told.text('layer') }),
  'map.area_kept': (told) => t('kept the map of {area}', { area: told.text('area') }),
  'map.area_let_go': (told) => t('let the map of {area} go', { area: told.text('area') }),
  'session.began': (told) => {
    const passkey = told.text('passkey');
    return passkey === '' ? t('signed in') : t('signed in with the passkey {passkey}', { passkey });
  },
  'session.ended': (told) => {
    const user = told.text('user');
    return user === '' ? t('signed out') : t('ended a sign-in of {user}', { user });
  },
  'session.refused': (told) => t('was refused: {why}', { why: told.text('why') }),
  'session.code_awaited': () => t('gave the right password, and was asked for a code'),
  'session.proved': () => t('confirmed who they are'),
  'user.created': (told) => t('created the account {user}', { user: told.text('user') }),
  'user.deleted': (told) => t('deleted the account {user}', { user: told.text('user') }),
  'user.enabled': (told) => t('enabled the account {user}', { user: told.text('user') }),
  'user.disabled': (told) => t('disabled the account {user}', { user: told.text('user') }),
  'user.role_changed': (told) =>
    t('changed the role of {user} to {role}', { user: told.text('user'), role: told.text('role') }),
  'user.password_changed': (told) => t('changed the password of {user}', { user: told.text('user') }),
  'user.second_factor_on': (told) => t('turned the second factor of {user} on', { user: told.text('user') }),
  'user.second_factor_off': (told) => t('turned the second factor of {user} off', { user: told.text('user') }),
  'user.recovery_codes_renewed': (told) => t('made new recovery codes for {user}', { user: told.text('user') }),
  'passkey.added': (told) => {
    told.text('user');
    return t('added the passkey {passkey}', { passkey: told.text('passkey') });
  },
  'passkey.removed': (told) => {
    const of = { passkey: told.text('passkey'), user: told.text('user') };
    return t('removed the passkey {passkey} of {user}', of);
  },
  'passkey.renamed': (told) =>
    t('renamed the passkey {before} to {passkey}', { before: told.text('before'), passkey: told.text('passkey') }),
  'token.created': (told) => {
    told.text('user');
    return t('created the token {token}', { token: told.text('token') });
  },
  'token.revoked': (told) => t('revoked the token {token} of {user}', ofTokens(told)),
  'token.expired': (told) => t('removed the expired token {token} of {user}', ofTokens(told)),
  'team.created': (told) => t('created the team {team}', { team: told.text('team') }),
  'team.deleted': (told) => t('deleted the team {team}', { team: told.text('team') }),
  'team.renamed': (told) =>
    t('renamed the team {before} to {team}', { before: told.text('before'), team: told.text('team') }),
  'team.invited': (told) =>
    t('invited {name} to the team {team}', { name: told.text('name'), team: told.text('team') }),
  'team.invitation_withdrawn': (told) =>
    t('took the invitation of {name} to the team {team} back', { name: told.text('name'), team: told.text('team') }),
  'team.invitation_declined': (told) => t('declined the invitation of {name} to a team', { name: told.text('name') }),
  'team.member_added': (told) =>
    t('added {user} to the team {team}', { user: told.text('user'), team: told.text('team') }),
  'team.member_removed': (told) =>
    t('removed {user} from the team {team}', { user: told.text('user'), team: told.text('team') }),
  'team.role_changed': (told) =>
    t('changed the role of {user} in the team {team}', { user: told.text('user'), team: told.text('team') }),
  'team.drone_added': (told) =>
    t('added {drone} to the team {team}', { drone: told.text('drone'), team: told.text('team') }),
  'team.drone_removed': (told) =>
    t('removed {drone} from the team {team}', { drone: told.text('drone'), team: told.text('team') }),
  'share.changed': (told) => t('changed the share “{share}”', { share: told.text('share') }),
  'tower.drain_asked': () => t('asked a tower to hand its drones over'),
  'enrolment.began': (told) => t('began to enrol {drone}', { drone: told.text('drone') }),
  'enrolment.used': (told) => t('enrolled {drone}', { drone: told.text('drone') }),
  'enrolment.cancelled': () => t('cancelled an enrolment'),
  'drone.created': (told) => t('added the drone {drone}', { drone: told.text('drone') }),
  'drone.deleted': (told) => t('deleted the drone {drone}', { drone: told.text('drone') }),
  'drone.renamed': (told) =>
    t('renamed the drone {before} to {drone}', { before: told.text('before'), drone: told.text('drone') }),
  'drone.key_set': (told) => t('gave {drone} a new key', { drone: told.text('drone') }),
  'drone.key_revoked': (told) => t('revoked the key of {drone}', { drone: told.text('drone') }),
  'drone.credential_exchanged': (told) => t('exchanged the credential of {drone}', { drone: told.text('drone') }),
  'drone.owner_added': (told) =>
    t('made {user} an owner of {drone}', { user: told.text('user'), drone: told.text('drone') }),
  'drone.owner_removed': (told) =>
    t('removed {user} as an owner of {drone}', { user: told.text('user'), drone: told.text('drone') }),
  'drone.lent': (told) =>
    t('lent {drone} to {user} until {until}', {
      drone: told.text('drone'),
      user: told.text('user'),
      until: told.text('until'),
    }),
  'drone.loan_ended': (told) =>
    t('ended the loan of {drone} to {user}', { drone: told.text('drone'), user: told.text('user') }),
  'drone.loan_expired': () => t('ended a loan: its time is over'),
  'drone.settings_changed': (told) => t('changed the settings of {drone}', { drone: told.text('drone') }),
  'drone.restrained': (told) =>
    t('restrained {drone}: {measure}', { drone: told.text('drone'), measure: told.text('measure') }),
  'drone.restraint_lifted': (told) => t('lifted the restraint of {drone}', { drone: told.text('drone') }),
  'drone.noise_judged': () => t('found that it sends too much'),
  'drone.motors_stopped': (told) => t('reported that its motors stopped {where}', { where: told.text('where') }),
  'drone.suspicious_motion': (told) => t('doubted its position: {why}', { why: told.text('why') }),
  'drone.loss_rehearsed': (told) =>
    t('rehearsed a loss ({what}): {result}', { what: told.text('what'), result: told.text('result') }),
  'drone.loss_check_acknowledged': () => t('acknowledged the dangers of the loss check'),
};

const ofTokens = (told: Told): { token: string; user: string } => ({
  token: told.text('token'),
  user: told.text('user'),
});

const WORKS: Readonly<Record<string, string>> = {
  plan_upload: t('plan to the drone'),
  plan_clear: t('clearing of the plan'),
  parameters_write: t('writing of parameters'),
  follow: t('following a drone'),
  follow_me: t('following a person'),
  agent_update: t('update of the agent'),
  signing: t('signing of the line'),
  controller: t('controller'),
  log_download: t('download of a log'),
};

/** An operation that is no command, in words. */
export const workName = (work: string): string => WORKS[work] ?? work.replaceAll('_', ' ');

const workWords = (told: Told): string => workName(told.text('work'));

function sentenceOf(action: string): Sentence | undefined {
  const [kind, what] = action.split('.') as [string, string];
  return SENTENCES[action] ?? (kind === 'control' ? CONTROL[what] : undefined);
}

/** Whether the sentence is known, and not made of the action's name. */
export const isToldInWords = (action: string): boolean => sentenceOf(action) !== undefined;

/** What was done, and what else is known of it: `name: value` pairs. */
export function eventWords(action: string, detail: Detail): { sentence: string; more: string } {
  const told = new Told(detail);
  let sentence = sentenceOf(action)?.(told) ?? action.replaceAll(/[._-]/g, ' ');
  if (told.is('result', 'refused')) {
    sentence = t('{sentence}: refused ({why})', { sentence, why: told.text('code').replaceAll('-', ' ') });
    told.text('result');
  }
  return { sentence, more: detailWords(told.rest()) };
}

/** `name: value` pairs; omits an id beside its name, and pairs without a value. */
export function detailWords(detail: Detail): string {
  return Object.entries(detail)
    .filter(
      ([name, value]) =>
        value !== null && value !== '' && !(name.endsWith('_id') && name.slice(0, -'_id'.length) in detail),
    )
    .map(([name, value]) => `${name.replaceAll('_', ' ')}: ${valueWords(value)}`)
    .join(', ');
}

function valueWords(value: unknown): string {
  if (typeof value === 'string') return MOMENT.test(value) ? dateMinute(value) : value;
  if (typeof value === 'boolean') return value ? t('yes') : t('no');
  return JSON.stringify(value);
}
