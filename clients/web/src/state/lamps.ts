/** Lamps put in, taken away, copied and aimed. */
import { signal } from '@preact/signals';
import { newId } from '../lib/ids';
import { add, length, scale, sub, type Vec3 } from '../lib/vec';
import type { Json, JsonObject } from '../protocol/rpc';
import type { Op, Pick } from '../protocol/types';
import { basis, poseFromOrbit } from '../view/camera';
import type { Edits } from './edits';
import { idForAsset } from './imports';
import { aimedAt, LAMP_KINDS, newLamp, type LampKind, type Mount } from './lamp_make';
import { extentOf, isPlaced, nameOf } from './lights';
import { arrayOps, luminaireOp, spreadOver, type Rows } from './luminaires';
import { anchorOf, anchoredAt } from './placement';
import type { SceneMirror } from './scene';
import { addOf } from './scene_ops';
import type { Toasts } from './toasts';
import type { ViewLink } from './view';
import { wayBack } from './way_back';

export interface LampsHost {
    scene: SceneMirror;
    edits: Edits;
    view: ViewLink;
    toasts: Toasts;
    call(method: string, params: JsonObject): Promise<JsonObject>;
    onError(error: Error): void;
    /** Of the picture, EV100. */
    ev(): number;
    /** What the user picked, where it is by now. */
    picked(): { pick: Pick; point: Vec3 } | null;
    /** What is under a place of the picture. */
    pick(x: number, y: number): Promise<Pick | null>;
}

/** Where a ceiling is looked for: down the middle of the picture. */
const CEILING_AT = [0.04, 0.1, 0.18, 0.26, 0.34];
/** A surface that looks down: within 45 degrees. */
const LOOKS_DOWN = -Math.SQRT1_2;

export class Lamps {
    readonly selected = signal<string | null>(null);
    /** The lamp that the next pick points at it; null: picks measure. */
    readonly aiming = signal<string | null>(null);

    constructor(private readonly host: LampsHost) {}

    /** Where the user picked, else under the ceiling in front of the camera, else in the air there. True: it is in the scene. */
    async add(kind: LampKind): Promise<boolean> {
        const { scene, edits, view, toasts, ev } = this.host;
        const mount = await this.mount();
        const r = Math.max(0.25 * view.orbit.value.distance, length(sub(mount.point, view.orbit.value.target)));
        const stem = LAMP_KINDS[kind].toLowerCase();
        const id = newId(stem, (taken) => scene.peek(taken) !== undefined);
        const fields = newLamp(kind, mount, r, ev());
        const added = await edits.transaction([{ op: 'add', type: 'light', id, ...fields }]);
        if (!added) return false;
        this.selected.value = id;
        toasts.announce(`Added ${id}, and selected it`);
        return true;
    }

    /** A lamp of a photometric file, on what is at that place of the picture; null: where add() puts one. True: it is there. */
    async place(asset: string, heightM: number, at: readonly [number, number] | null): Promise<boolean> {
        const { scene, edits, toasts, pick } = this.host;
        const hit = at && (await pick(...at));
        if (at && !hit) {
            toasts.info('Nothing is there to hang it on');
            return false;
        }
        const mount = hit ? { point: hit.point, normal: hit.normal } : await this.mount();
        const id = idForAsset(asset, (taken) => scene.peek(taken) !== undefined);
        if (!(await edits.transaction([luminaireOp(id, asset, mount, heightM)]))) return false;
        this.selected.value = id;
        toasts.announce(`Placed ${id}${hit ? ` on ${hit.id}` : ''}, and selected it: arrow keys move it, with Shift at its height`);
        return true;
    }

    /** Rows over the whole floor at the height of the lamp; null: there is no floor, which is said. */
    async overFloor(id: string, columns: number, rows: number): Promise<Rows | null> {
        const { scene, call, onError } = this.host;
        try {
            const floor = await call('sensor.place', { border_m: 0 });
            const record = scene.peek(id);
            return record ? spreadOver(record, floor, columns, rows) : null;
        } catch (error) {
            onError(error as Error);
            return null;
        }
    }

    /** The lamp and its copies in columns and rows, as one step. */
    async array(id: string, rows: Rows): Promise<void> {
        const { scene, edits, toasts } = this.host;
        const record = scene.peek(id);
        if (!record) return;
        const ops = arrayOps(record, rows, (taken) => scene.peek(taken) !== undefined);
        if (await edits.transaction(ops)) toasts.announce(`${rows.columns * rows.rows} lamps in ${rows.rows} rows`);
    }

    /** True: it is gone. */
    async remove(id: string): Promise<boolean> {
        const { scene, edits, toasts } = this.host;
        const record = scene.peek(id);
        if (!record) return false;
        const gone = edits.transaction([{ op: 'remove', id }]);
        const { step } = edits; // before another edit is made
        if (!(await gone)) return false;
        if (this.aiming.value === id) this.aiming.value = null;
        if (this.selected.value === id) this.selected.value = null;
        toasts.info(`Removed ${nameOf(record)}`, [{ label: 'Undo', run: wayBack(edits, toasts, step, [record]) }]);
        return true;
    }

    /** A copy beside it, to the right as one sees it. */
    async duplicate(id: string): Promise<void> {
        const { scene, edits, view, toasts } = this.host;
        const record = scene.peek(id);
        if (!record) return;
        if (record.kind === 'ies' && !record.asset) {
            toasts.info(`${nameOf(record)} has its light from the model that it came with: import the model again for another one`);
            return;
        }
        const copy = newId(nameOf(record).replace(/-\d+$/, ''), (taken) => scene.peek(taken) !== undefined);
        const { right } = basis(poseFromOrbit(view.orbit.value));
        const beside = add(anchorOf(record), scale(right, 2.5 * extentOf(record)));
        const { path, value } = anchoredAt(record, beside);
        const ops: Op[] = [addOf(record, copy)];
        if (isPlaced(record)) ops.push({ op: 'set', id: copy, path, value });
        if (!(await edits.transaction(ops))) return;
        this.selected.value = copy;
        toasts.announce(`Copied ${id} as ${copy}, and selected it`);
    }

    /** Ends the aiming. */
    pointAt(point: Vec3): void {
        const { scene, edits, toasts } = this.host;
        const id = this.aiming.value;
        const record = id ? scene.peek(id) : undefined;
        this.aiming.value = null;
        if (!record) return;
        const op = aimedAt(record, point);
        if (op.op === 'set') edits.setOnce(op.id, op.path, op.value);
        toasts.announce(`${record.id} points at ${point.map((v) => v.toFixed(2)).join(', ')} metres`);
    }

    /** "": in no group. */
    setGroup(id: string, group: string): void {
        this.host.edits.setOnce(id, '/group', (group || null) as Json);
    }

    /** After any change of the scene. */
    forgetIfGone(): void {
        for (const s of [this.selected, this.aiming]) {
            const id = s.peek();
            if (id && !this.host.scene.peek(id)) s.value = null;
        }
    }

    private async mount(): Promise<Mount> {
        const { view, picked } = this.host;
        const at = picked();
        if (at) return { point: at.point, normal: at.pick.normal };
        const pose = poseFromOrbit(view.orbit.value);
        const middle = scale(add(pose.position, pose.target), 0.5);
        const ceiling = await this.ceilingOver(middle, pose.position);
        return ceiling ?? { point: add(middle, scale(basis(pose).up, 0.15 * view.orbit.value.distance)), normal: null };
    }

    /** The place on a surface that looks down which is most nearly over `point`. */
    private async ceilingOver(point: Vec3, eye: Vec3): Promise<Mount | null> {
        const hits = await Promise.all(CEILING_AT.map((y) => this.host.pick(0.5, y)));
        const away = (p: Vec3): number => Math.hypot(p[0] - point[0], p[2] - point[2]);
        const ceilings = hits.filter((h): h is Pick => h !== null && h.normal[1] < LOOKS_DOWN && h.point[1] > eye[1]);
        const best = ceilings.sort((a, b) => away(a.point) - away(b.point))[0];
        return best ? { point: best.point, normal: best.normal } : null;
    }
}

/** Of those that are in the picture the nearest `most`, and the selected ones in any case, last: on top. */
export function markedOf(
    ids: readonly string[],
    selected: readonly string[],
    most: number,
    depth: (id: string) => number | null,
): string[] {
    const [chosen, all] = [new Set(selected), new Set(ids)];
    const others = ids.filter((id) => !chosen.has(id));
    const seen = others.map((id) => ({ id, depth: depth(id) })).filter((m): m is { id: string; depth: number } => m.depth !== null);
    const nearest = seen.length > most ? seen.sort((a, b) => a.depth - b.depth).slice(0, most) : seen;
    return [...nearest.map((m) => m.id), ...selected.filter((id) => all.has(id))];
}

