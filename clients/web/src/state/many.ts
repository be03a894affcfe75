/** What is said of several records together, and how one field of all is set, and they are copied. Pure. */
import { newId } from '../lib/ids';
import { add, type Vec3 } from '../lib/vec';
import type { Json } from '../protocol/rpc';
import { stringOr, type Op, type SceneRecord } from '../protocol/types';
import { isLamp, isPlaced, nameOf } from './lights';
import { anchorOf, anchoredAt } from './placement';
import { addOf } from './scene_ops';

/** What all have; null: they differ, or there is none. */
export function common(values: readonly (number | null)[]): number | null {
    const [first] = values;
    if (first === undefined || first === null) return null;
    const tolerance = 1.1e-5 * Math.abs(first); // numbers are sent with six digits: two that are the same may be twice 5e-6 apart
    return values.every((v) => v !== null && Math.abs(v - first) <= tolerance) ? first : null;
}

/** Of light from far away there is no place. */
export const hasPlace = (record: SceneRecord): boolean => record.type !== 'light' || isPlaced(record);

export const fieldOfAll = (records: readonly SceneRecord[], path: string, value: Json): Op[] =>
    records.map((r) => ({ op: 'set', id: r.id, path, value }));

export const placedAt = (record: SceneRecord, point: Vec3): Op => ({ op: 'set', id: record.id, ...anchoredAt(record, point) });

/** A model is imported again, and a lamp without a file has its light from one. */
export const canCopy = (record: SceneRecord): boolean => (record.type === 'object' || record.type === 'light') && (record.kind !== 'ies' || Boolean(record.asset));

/** Copies of those that can be, `offset` away; ids: of the copies. */
export function copyOps(records: readonly SceneRecord[], offset: Vec3, taken: (id: string) => boolean): { ops: Op[]; ids: string[] } {
    const ops: Op[] = [];
    const ids: string[] = [];
    for (const record of records.filter(canCopy)) {
        const id = newId(nameOf(record).replace(/-\d+$/, ''), (name) => ids.includes(name) || taken(name));
        ids.push(id);
        ops.push(addOf(record, id));
        if (hasPlace(record)) ops.push({ ...placedAt(record, add(anchorOf(record), offset)), id } as Op);
    }
    return { ops, ids };
}

/** It shines where these alone do: by itself, or with its group. */
export const isSoloed = (lamp: SceneRecord, solo: readonly string[]): boolean => solo.includes(lamp.id) || solo.includes(stringOr(lamp.group, ''));

/** What the server is told so that these lamps alone shine: their ids, and in place of all of a group its name. all: of the scene. */
export function soloNames(lamps: readonly SceneRecord[], all: readonly SceneRecord[]): string[] {
    const wanted = new Set(lamps.map((l) => l.id));
    const partial = new Set(all.filter((l) => !wanted.has(l.id)).flatMap((l) => [l.id, stringOr(l.group, '')])); // a name may be a lamp's and a group's
    const isWhole = (group: string): boolean => group !== '' && !partial.has(group) && lamps.filter((l) => l.group === group).length > 1;
    return [...new Set(lamps.map((l) => (isWhole(stringOr(l.group, '')) ? stringOr(l.group, '') : l.id)))];
}

/** "3 lamps", "2 lamps, 1 object" */
export function inWords(records: readonly SceneRecord[]): string {
    const lamps = records.filter(isLamp).length;
    const count = (n: number, what: string): string[] => (n > 0 ? [`${n} ${what}${n === 1 ? '' : 's'}`] : []);
    return [...count(lamps, 'lamp'), ...count(records.length - lamps, 'object')].join(', ');
}
