/** Several lamps and objects that are handled as one: which they are, and what is done to all of them in one step. */
import { batch, computed, effect, signal } from '@preact/signals';
import { dot, scale } from '../lib/vec';
import type { JsonObject } from '../protocol/rpc';
import { stringOr, type Op, type SceneRecord } from '../protocol/types';
import { basis, poseFromOrbit } from '../view/camera';
import type { Edits } from './edits';
import type { Lamps } from './lamps';
import { extentOf, isLamp, isOn } from './lights';
import { copyOps, fieldOfAll, hasPlace, inWords, isSoloed, soloNames } from './many';
import { anchorOf } from './placement';
import type { SceneMirror } from './scene';
import type { Toasts } from './toasts';
import { MOST_SOLO, type ViewLink } from './view';
import { wayBack } from './way_back';

export interface SelectionHost {
    scene: SceneMirror;
    edits: Edits;
    view: ViewLink;
    toasts: Toasts;
    lamps: Lamps;
    call(method: string, params: JsonObject): Promise<JsonObject>;
    onError(error: Error): void;
}

/** Modifier keys of a click: Ctrl, or Cmd, adds one; Shift all up to it. */
export interface Modifiers {
    ctrlKey: boolean;
    metaKey: boolean;
    shiftKey: boolean;
}

export class Selection {
    /** In the order in which they were selected. Empty where one lamp is, which shows itself in the list. */
    readonly many = signal<readonly string[]>([]);
    readonly ids = computed<readonly string[]>(() => {
        const one = this.host.lamps.selected.value;
        return this.many.value.length > 0 ? this.many.value : one === null ? [] : [one];
    });
    /** The same, to look one up. */
    readonly chosen = computed<ReadonlySet<string>>(() => new Set(this.ids.value));
    /** What is selected, as it was when it was. */
    private readonly founds = new Map<string, SceneRecord>();
    /** Where a range begins. */
    private from: string | null = null;

    constructor(private readonly host: SelectionHost) {
        effect(() => {
            if (host.lamps.selected.value !== null) this.many.value = [];
        });
        effect(() => {
            for (const id of this.founds.keys()) if (!this.chosen.value.has(id)) this.founds.delete(id);
            for (const id of this.ids.value) this.find(id, host.scene.peek(id));
        });
    }

    records(): SceneRecord[] {
        return this.ids.value.map((id) => this.host.scene.record(id)).filter((r) => r !== undefined);
    }

    /** A lamp as it was when it was selected, whichever others joined it or left since: what percent of it are of. */
    found(light: SceneRecord): SceneRecord {
        return this.find(light.id, light)!;
    }

    private find(id: string, now: SceneRecord | undefined): SceneRecord | undefined {
        if (now && !this.founds.has(id) && this.chosen.peek().has(id)) this.founds.set(id, now);
        return this.founds.get(id) ?? now;
    }

    /** Without what comes along with a model that is selected, too: moved, or removed, it would be twice. */
    wholes(): SceneRecord[] {
        const records = this.records();
        const models = new Set(records.filter((r) => r.type === 'import').map((r) => r.id));
        return records.filter((r) => !models.has(stringOr(r.origin, '')));
    }

    /** What moves with it. */
    with(id: string): readonly string[] {
        return this.many.peek().includes(id) ? this.wholes().map((r) => r.id) : [id];
    }

    set(ids: readonly string[]): void {
        const { lamps, scene, toasts } = this.host;
        const one = ids.length === 1 && isLamp(scene.peek(ids[0]!)) ? ids[0]! : null;
        batch(() => {
            lamps.selected.value = one;
            this.many.value = one === null ? ids : [];
        });
        const said = inWords(ids.map((id) => scene.peek(id)).filter((r) => r !== undefined));
        toasts.announce(said ? `${said} selected` : 'Nothing is selected');
    }

    /** In, or out; the others stay. */
    toggle(id: string): void {
        const ids = this.ids.peek();
        this.from = id;
        this.set(ids.includes(id) ? ids.filter((one) => one !== id) : [...ids, id]);
    }

    /** All lines from where the last choice was. order: of the list. */
    rangeTo(id: string, order: readonly string[]): void {
        const began = [this.from, this.host.lamps.selected.peek(), id].find((one) => one !== null && order.includes(one)) ?? id;
        const [a, b] = [order.indexOf(began), order.indexOf(id)];
        this.from = began;
        this.set(a <= b ? order.slice(a, b + 1) : order.slice(b, a + 1).reverse());
    }

    /** A click on the name of a lamp, or on its mark. order: of what a range goes over; absent: there is none. */
    click(id: string, { ctrlKey, metaKey, shiftKey }: Modifiers, order?: readonly string[]): void {
        const { selected } = this.host.lamps;
        if (order && shiftKey) this.rangeTo(id, order);
        else if (ctrlKey || metaKey || shiftKey) this.toggle(id);
        else {
            this.from = id;
            if (!isLamp(this.host.scene.peek(id))) {
                const ids = this.ids.peek();
                this.set(ids.length === 1 && ids[0] === id ? [] : [id]);
                return;
            }
            selected.value = selected.value === id ? null : id;
            if (selected.value === null) this.many.value = [];
        }
    }

    clear(): void {
        this.from = null;
        this.many.value = [];
        this.host.lamps.selected.value = null;
    }

    forgetIfGone(): void {
        const left = this.many.peek().filter((id) => this.host.scene.peek(id));
        if (left.length !== this.many.peek().length) this.many.value = left;
    }

    /** True: it is done, and said. */
    async apply(ops: readonly Op[], said: string): Promise<boolean> {
        if (ops.length === 0 || !(await this.host.edits.transaction([...ops]))) return false;
        this.host.toasts.announce(said);
        return true;
    }

    switchAll(): Promise<boolean> {
        const lamps = this.records().filter(isLamp);
        const on = !lamps.some(isOn);
        return this.apply(fieldOfAll(lamps, '/on', on), `${inWords(lamps)} ${on ? 'on' : 'off'}`);
    }

    solo(): void {
        const { scene, view, toasts } = this.host;
        const lamps = this.records().filter(isLamp);
        if (lamps.length === 0) {
            toasts.announce('No lamp is selected');
            return;
        }
        const { solo } = view.settings.peek();
        const already = lamps.every((r) => isSoloed(r, solo));
        const all = scene.lamps.peek().map((id) => scene.peek(id)).filter((r) => r !== undefined);
        const names = already ? [] : soloNames(lamps, all);
        if (names.length > MOST_SOLO) {
            toasts.info(`A view shows at most ${MOST_SOLO} lamps or whole groups alone, and these are ${names.length}: give them a group`);
            return;
        }
        view.change({ solo: names });
        toasts.announce(already ? 'All lamps that are on shine again' : `Only ${lamps.length === 1 ? `${lamps[0]!.id} shines` : `${lamps.length} lamps shine`}, in your view alone`);
    }

    /** True: it is gone. */
    async remove(): Promise<boolean> {
        const { edits, toasts, lamps } = this.host;
        if (this.many.peek().length === 0) {
            return lamps.selected.peek() !== null && lamps.remove(lamps.selected.peek()!);
        }
        const records = this.wholes();
        const gone = edits.transaction(records.map((r) => ({ op: 'remove', id: r.id })));
        const { step } = edits; // before another edit is made
        if (!(await gone)) return false;
        this.clear();
        toasts.info(`Removed ${inWords(records)}`, [{ label: 'Undo', run: wayBack(edits, toasts, step, records) }]);
        return true;
    }

    /** Copies beside all of them, to the right as one sees it, and selected. */
    async duplicate(): Promise<void> {
        const { scene, edits, view, toasts, lamps } = this.host;
        if (this.many.peek().length === 0) {
            if (lamps.selected.peek() !== null) await lamps.duplicate(lamps.selected.peek()!);
            return;
        }
        const records = this.records();
        const { right } = basis(poseFromOrbit(view.orbit.peek()));
        const at = records.filter(hasPlace).map((r) => dot(anchorOf(r), right));
        const gap = Math.max(0, ...records.map(extentOf)) * 2.5;
        const { ops, ids } = copyOps(records, scale(right, Math.max(...at) - Math.min(...at) + gap), (id) => scene.peek(id) !== undefined);
        const left = records.length - ids.length;
        if (left > 0) toasts.info(`${left} of them came with a model, which only an import makes again`);
        if (ids.length === 0 || !(await edits.transaction(ops))) return;
        this.set(ids);
        toasts.announce(`Copied as ${ids.length} more, and selected them`);
    }

    /** Into the tiles of a ceiling over the floor. */
    async intoTiles(tileM: number): Promise<void> {
        const { call, onError, toasts } = this.host;
        try {
            const [{ tileOps }, floor] = await Promise.all([import('./arrange'), call('sensor.place', { border_m: 0 })]);
            const ops = tileOps(this.wholes(), floor, tileM);
            if (ops) await this.apply(ops, `In the middles of ${ops.length} tiles`);
            else toasts.info('The ceiling has fewer tiles than that');
        } catch (error) {
            onError(error as Error);
        }
    }
}
