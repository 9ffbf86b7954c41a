/** The commands, grouped as people look for them. */

import { t } from '../../languages/text';
import { FAMILIES } from '../../link/generated/autopilots.gen';
import { CATALOGUE, CMD, isKnownTo, type AutopilotKind, type CommandSpec } from '../../plan/catalogue';

export interface CommandGroup {
  readonly title: string;
  readonly specs: readonly CommandSpec[];
}

const CAMERA: ReadonlySet<number> = new Set([
  CMD.TRIGGER_DISTANCE,
  CMD.CAMERA_SHOT,
  CMD.IMAGE_START,
  CMD.IMAGE_STOP,
  CMD.VIDEO_START,
  CMD.VIDEO_STOP,
  CMD.ROI_LOCATION,
  CMD.ROI,
  CMD.ROI_NONE,
  CMD.GIMBAL_PITCH_YAW,
  CMD.MOUNT_CONTROL,
]);
const WAY: ReadonlySet<number> = new Set([
  CMD.CHANGE_SPEED,
  CMD.JUMP,
  CMD.NAV_DELAY,
  CMD.CONDITION_DELAY,
  CMD.CONDITION_DISTANCE,
  CMD.CONDITION_YAW,
  CMD.SET_HOME,
  CMD.LAND_START,
]);

const all = [...CATALOGUE.values()];
const flies = (one: CommandSpec): boolean => one.flies || one.command === CMD.RETURN;

export const COMMAND_GROUPS: readonly CommandGroup[] = [
  { title: t('Fly'), specs: all.filter(flies) },
  { title: t('On the way'), specs: all.filter(({ command }) => WAY.has(command)) },
  { title: t('Camera'), specs: all.filter(({ command }) => CAMERA.has(command)) },
  {
    title: t('Other'),
    specs: all.filter((one) => !flies(one) && !WAY.has(one.command) && !CAMERA.has(one.command)),
  },
];

/** With a note if this autopilot does not carry it out. */
export const choiceWords = (spec: CommandSpec, autopilot: AutopilotKind): string =>
  isKnownTo(spec, autopilot)
    ? spec.label
    : t('{spec} (not {families})', { spec: spec.label, families: FAMILIES[autopilot].label });
