/**
 * The client's copy of the scene. One signal per record, so that an edit redraws one row and not the list.
 *
 * `confirmed` is what the server said. Values the user is setting right now are kept apart and laid over it: what is shown
 * never jumps back while an edit travels, and falls back by itself when the edit is refused.
 */
import { batch, signal, type ReadonlySignal, type Signal } from '@preact/signals';
import { byName } from '../lib/ids';
import { isObject, type Json, type JsonObject } from '../protocol/rpc';
import { INTENSITY_FIELDS, stringOr, type SceneRecord } from '../protocol/types';

/**
 * A copy of the record with one field changed; null when the path does not fit it. Path: "/transform/translate/1". With the
 * path "" value holds several fields. Setting one of a group unsets the others of it, whether or not the server says so.
 */
export function withField(record: SceneRecord, path: string, value: Json): SceneRecord | null {
    if (path === '') {
        if (!isObject(value)) return null;
        const fields = { ...value, type: record.type, id: record.id };
        return { ...Object.keys(value).reduce((r, key) => withoutRivals(r, key, value[key]), record), ...fields };
    }
    const keys = path.split('/').slice(1);
    if (keys.length === 0 || keys.some((k) => k === '')) return null;
    return replaceIn(withoutRivals(record, keys[0]!, value), keys, value) as SceneRecord | null;
}

/** Fields that exclude each other. */
const GROUPS: readonly (readonly string[])[] = [INTENSITY_FIELDS, ['color', 'cct_k'], ['asset', 'pixels', 'web']];

function withoutRivals(record: SceneRecord, key: string, value: Json | undefined): SceneRecord {
    const rivals = GROUPS.find((g) => g.includes(key))?.filter((k) => k !== key && k in record) ?? [];
    if (value === null || rivals.length === 0) return record;
    return { ...record, ...Object.fromEntries(rivals.map((k) => [k, null])) };
}

function replaceIn(node: Json | undefined, keys: string[], value: Json): Json | null {
    const [key, ...rest] = keys;
    if (key === undefined) return value;
    if (Array.isArray(node)) {
        const index = Number(key);
        if (!(Number.isInteger(index) && index >= 0 && index < node.length)) return null;
        const inner = replaceIn(node[index], rest, value);
        return inner === null && rest.length > 0 ? null : node.map((v, i) => (i === index ? inner : v));
    }
    if (!isObject(node)) return null;
    const inner = replaceIn(node[key], rest, value);
    return inner === null && rest.length > 0 ? null : { ...node, [key]: inner };
}

const withoutOp = (op: JsonObject): JsonObject => Object.fromEntries(Object.entries(op).filter(([key]) => key !== 'op'));

const LISTED = ['light', 'camera', 'import', 'sensor', 'patch', 'preset', 'material'] as const;
type Listed = (typeof LISTED)[number];

export class SceneMirror {
    readonly rev = signal(0);
    /** Lights, then objects that shine. */
    readonly lamps = signal<readonly string[]>([]);
    private readonly lists: Record<Listed, Signal<readonly string[]>> = {
        light: signal([]),
        camera: signal([]),
        import: signal([]),
        sensor: signal([]),
        patch: signal([]),
        preset: signal([]),
        material: signal([]),
    };
    private confirmed = new Map<string, SceneRecord>();
    private readonly shown = new Map<string, Signal<SceneRecord | undefined>>();
    private readonly pending = new Map<string, Map<string, Json>>();

    list(type: Listed): ReadonlySignal<readonly string[]> {
        return this.lists[type];
    }

    /** The record as shown now; a component that calls this is drawn again when the record changes. */
    record(id: string): SceneRecord | undefined {
        return this.signalOf(id).value;
    }

    peek(id: string): SceneRecord | undefined {
        return this.signalOf(id).peek();
    }

    /** The ids of one type, in scene order, without subscribing. */
    idsOfType(type: string): string[] {
        const ids: string[] = [];
        for (const record of this.confirmed.values()) if (record.type === type) ids.push(record.id);
        return ids;
    }

    /** The objects that are made of it, in scene order, without subscribing. */
    objectsOf(material: string): string[] {
        const ids: string[] = [];
        for (const record of this.confirmed.values()) if (record.type === 'object' && record.material === material) ids.push(record.id);
        return ids;
    }

    /** Replaces everything by the ops of scene.get{expand:true}. */
    load(ops: Json | undefined, rev: number): void {
        batch(() => {
            // The settings record always exists; ops only say where it differs from what the server does by itself.
            this.confirmed = new Map([['render', { type: 'render', id: 'render' }]]);
            for (const op of Array.isArray(ops) ? ops : []) if (isObject(op)) this.applyOne(op);
            for (const id of this.shown.keys()) this.refresh(id);
            this.relist();
            this.rev.value = rev;
        });
    }

    /** Follows a scene.changed. emits: what became of objects that shine. False: this copy no longer matches, load it again. */
    apply(ops: Json | undefined, rev: number, emits?: Json): boolean {
        if (!Array.isArray(ops) || rev > this.rev.peek() + 1) return false;
        if (rev <= this.rev.peek()) return true;
        return batch(() => {
            const touched = new Set<string>();
            let structural = false;
            for (const op of ops) {
                if (!isObject(op) || !this.applyOne(op)) {
                    this.relist(); // until it is loaded again, no list names what is gone
                    return false;
                }
                touched.add(stringOr(op.id, ''));
                structural ||= op.op !== 'set';
            }
            for (const [id, change] of Object.entries(isObject(emits) ? emits : {})) {
                structural = this.shineOtherwise(id, change ?? null) || structural;
                touched.add(id);
            }
            for (const id of touched) this.refresh(id);
            if (structural) this.relist();
            this.rev.value = rev;
            return true;
        });
    }

    /** Shows `value` until settle() is called for it. */
    expect(id: string, path: string, value: Json): void {
        let fields = this.pending.get(id);
        if (!fields) this.pending.set(id, (fields = new Map<string, Json>()));
        fields.set(path, value);
        this.refresh(id);
    }

    /** The server answered. accepted: keep the value until its scene.changed arrives, which says the same. */
    settle(id: string, path: string, value: Json, accepted: boolean): void {
        const fields = this.pending.get(id);
        if (!fields || fields.get(path) !== value) return; // a newer value is on its way
        fields.delete(path);
        if (fields.size === 0) this.pending.delete(id);
        const record = this.confirmed.get(id);
        const changed = accepted && record ? withField(record, path, value) : null;
        if (changed) this.confirmed.set(id, changed);
        this.refresh(id);
    }

    private applyOne(op: JsonObject): boolean {
        const id = stringOr(op.id, '');
        if (op.op === 'add' && typeof op.type === 'string') {
            this.confirmed.set(id, withoutOp(op) as SceneRecord);
            return true;
        }
        if (op.op === 'import') {
            this.confirmed.set(id, { ...withoutOp(op), type: 'import' } as SceneRecord);
            return false; // what it brought is not named
        }
        if (op.op === 'remove') {
            const known = this.confirmed.get(id);
            this.confirmed.delete(id);
            return known?.type !== 'import'; // what it brought goes with it, unnamed
        }
        const record = this.confirmed.get(id);
        if (op.op !== 'set' || !record || typeof op.path !== 'string') return false;
        const changed = withField(record, op.path, op.value ?? null);
        if (changed) this.confirmed.set(id, changed);
        return changed !== null;
    }

    /** True when it begins or ends to be a lamp. */
    private shineOtherwise(id: string, change: Json): boolean {
        const record = this.confirmed.get(id);
        if (!record) return false;
        const { emits, ...rest } = record;
        const shines = isObject(change);
        const before = isObject(emits) ? emits : {};
        this.confirmed.set(id, (shines ? { ...rest, emits: { ...before, ...change } } : rest) as SceneRecord);
        return shines !== isObject(emits);
    }

    private signalOf(id: string): Signal<SceneRecord | undefined> {
        let s = this.shown.get(id);
        if (!s) this.shown.set(id, (s = signal(this.confirmed.get(id))));
        return s;
    }

    private refresh(id: string): void {
        const s = this.shown.get(id);
        if (!s) return; // nobody looked at it yet; signalOf starts from confirmed
        let record = this.confirmed.get(id);
        for (const [path, value] of this.pending.get(id) ?? []) {
            if (record) record = withField(record, path, value) ?? record;
        }
        s.value = record;
    }

    private relist(): void {
        for (const type of LISTED) this.lists[type].value = this.idsOfType(type).sort(byName);
        const luminaires = this.idsOfType('object').filter((id) => isObject(this.confirmed.get(id)?.emits));
        this.lamps.value = [...this.lists.light.value, ...luminaires.sort(byName)];
    }
}
