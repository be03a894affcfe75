/** What can be said of ops without sending them: are they done already, how are records made again, which file they make. */
import { isObject, type Json, type JsonObject } from '../protocol/rpc';
import type { Op, SceneRecord } from '../protocol/types';

/** True when the scene is as the op would make it. record: of the op's id. */
export function isDone(op: Op, record: SceneRecord | undefined): boolean {
    if (op.op === 'remove') return record === undefined;
    if (!record) return false;
    if (op.op !== 'set') return true; // ids are not given twice
    if (op.path !== '') return same(at(record, op.path.split('/').slice(1)), op.value);
    return isObject(op.value) && Object.entries(op.value).every(([key, v]) => same(record[key], v));
}

function at(node: Json | undefined, keys: readonly string[]): Json | undefined {
    for (const key of keys) {
        if (Array.isArray(node)) node = node[Number(key)];
        else if (isObject(node)) node = node[key];
        else return undefined;
    }
    return node;
}

/** null is what an absent field is. */
const same = (a: Json | undefined, b: Json | undefined): boolean => JSON.stringify(a ?? null) === JSON.stringify(b ?? null);

/** Fields that the server tells of a record, and that no client may give. */
const TOLD: readonly string[] = ['emits', 'origin', 'op', 'photometry'];

/** The op that makes the record, as it is now, under another id or again. */
export function addOf(record: SceneRecord, id = record.id): Op {
    const fields = Object.entries(record).filter(([key, v]) => !TOLD.includes(key) && v !== null && v !== undefined);
    return { ...(Object.fromEntries(fields) as JsonObject & { type: string }), op: 'add', id };
}

/** The ops of scene.get as a file that `lumend render --scene` and `lumend --scene` read. */
export function sceneFile(ops: readonly Json[], title: string): string {
    const header = { lumend: 1, kind: 'scene', title };
    return [header, ...ops].map((line) => `${JSON.stringify(line)}\n`).join('');
}
