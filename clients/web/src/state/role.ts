/** What whose token this is may do. Each role may do all that those before it may; the server holds to it, too. */
import type { Json } from '../protocol/rpc';

const ROLES = ['view', 'measure', 'edit', 'admin'] as const;
export type Role = (typeof ROLES)[number];

/** A server that says nothing, or something new, is asked, and refuses what is not for us. */
export const roleOf = (said: Json | undefined): Role => ROLES.find((r) => r === said) ?? 'edit';

export const may = (role: Role, needed: Role): boolean => ROLES.indexOf(role) >= ROLES.indexOf(needed);

/** For people, where something is not for them. */
export const NOT_TO_EDIT = 'With your token you may look, not change. Whoever runs the server can give you one for edits.';
export const NOT_IN_THE_PAST = 'You look at an earlier moment: go to now, or back to it, to change something.';
export const NOT_TO_MEASURE = 'With your token you may look, not measure.';
