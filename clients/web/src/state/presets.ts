/** Looks of the room's light under a name: recalled at once or with a crossfade, which the server makes for everybody. */
import { computed, signal } from '@preact/signals';
import { newId } from '../lib/ids';
import type { JsonObject } from '../protocol/rpc';
import { numberOr, stringOr, type Op, type SceneRecord } from '../protocol/types';
import type { Edits } from './edits';
import type { SceneMirror } from './scene';

export const MOST_FADE_S = 3600;
export const MOST_NAME_BYTES = 127;

export const nameOf = (preset: SceneRecord): string => stringOr(preset.name, '') || preset.id;

/** As they are shown. */
export function inOrder(presets: readonly SceneRecord[]): SceneRecord[] {
    const order = (p: SceneRecord): number => numberOr(p.order, 0);
    return [...presets].sort((a, b) => order(a) - order(b) || (a.id < b.id ? -1 : 1));
}

/** The edits that put it one place up (-1) or down (1); none where it is the first or the last. */
export function moved(presets: readonly SceneRecord[], id: string, by: -1 | 1): Op[] {
    const ids = inOrder(presets).map((p) => p.id);
    const at = ids.indexOf(id);
    const other = ids[at + by];
    if (at < 0 || other === undefined) return [];
    [ids[at], ids[at + by]] = [other, id];
    const changed = ids.map((one, k): [string, number] => [one, k + 1]).filter(([one, k]) => presets.find((p) => p.id === one)?.order !== k);
    return changed.map(([one, k]) => ({ op: 'set', id: one, path: '/order', value: k }));
}

/** Of an id: its letters and digits. */
export const stemOf = (name: string): string => `preset-${name.toLowerCase().replace(/[^a-z0-9]+/g, '-').replace(/^-|-$/g, '').slice(0, 32) || 'look'}`;

export interface PresetsHost {
    scene: SceneMirror;
    edits: Edits;
    announce(text: string): void;
}

export class Presets {
    readonly list = computed(() => inOrder(this.host.scene.list('preset').value.map((id) => this.host.scene.record(id)).filter((p) => p !== undefined)));
    /** What a recall of this page takes. */
    readonly fadeS = signal(2);
    /** On its way, for everybody; null: all lamps have arrived. */
    readonly fading = signal<{ id: string; fadeS: number; count: number } | null>(null);
    /** Recalled last, by whomever. */
    readonly last = signal('');
    private count = 0;

    constructor(private readonly host: PresetsHost) {}

    async store(name: string): Promise<boolean> {
        const id = newId(stemOf(name), (taken) => this.host.scene.peek(taken) !== undefined);
        const done = await this.host.edits.request('preset.store', { id, name });
        if (done) this.host.announce(`${name} keeps the light as it is now`);
        return done;
    }

    async update(preset: SceneRecord): Promise<void> {
        if (await this.host.edits.request('preset.store', { id: preset.id })) this.host.announce(`${nameOf(preset)} keeps the light as it is now`);
    }

    recall(preset: SceneRecord): void {
        void this.host.edits.request('preset.recall', { id: preset.id, fade_s: this.fadeS.peek() });
    }

    stop(): void {
        void this.host.edits.request('preset.stop', {});
    }

    rename(preset: SceneRecord, name: string): void {
        if (name !== '' && name !== nameOf(preset)) this.host.edits.setOnce(preset.id, '/name', name);
    }

    move(preset: SceneRecord, by: -1 | 1): void {
        const ops = moved(this.list.peek(), preset.id, by);
        if (ops.length > 0) void this.host.edits.transaction(ops);
    }

    remove(preset: SceneRecord): void {
        void this.host.edits.transaction([{ op: 'remove', id: preset.id }]);
    }

    /** preset.fading of the server. */
    notified(params: JsonObject): void {
        const id = stringOr(params.id, '');
        const leftS = numberOr(params.left_s, 0);
        const preset = this.host.scene.peek(id);
        const name = preset ? nameOf(preset) : id;
        this.last.value = id;
        this.fading.value = leftS > 0 ? { id, fadeS: leftS, count: ++this.count } : null;
        this.host.announce(leftS > 0 ? `${name}, in ${leftS} seconds` : `${name}: all lamps have arrived`);
    }

    closed(): void {
        this.fading.value = null;
    }
}
