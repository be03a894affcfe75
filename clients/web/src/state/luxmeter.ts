/**
 * The light that falls on a picked point: measured again after every edit, whoever made it, and more precisely for as long as
 * nothing changes. A number is of one revision of the scene; at any other it is shown as old.
 */
import { computed, effect, signal, type ReadonlySignal } from '@preact/signals';
import { Debounce } from '../lib/debounce';
import { add, sub, type Vec3 } from '../lib/vec';
import type { JsonObject } from '../protocol/rpc';
import { numberOr, type Pick } from '../protocol/types';
import { anchorOf } from './placement';
import type { SceneMirror } from './scene';

export interface Lux {
    value: number;
    stderr: number;
    /** Of the scene that it was measured in. */
    rev: number;
    /** The lamps that were shown alone then. */
    solo: readonly string[];
}

export interface Reading {
    pick: Pick;
    /** What the point lies on and moves with: an object, or the model that it belongs to. offset: from its anchor. */
    carrier: { id: string; offset: Vec3 } | null;
    /** null: not measured yet. */
    lux: Lux | null;
}

const SAMPLES = [512, 4096, 32768];
/** Standard error, relative, below which nobody asks for more. */
const PRECISE = 0.005;
/** After an edit the meter waits for the hand to rest: a probe costs rays that the picture wants. But a hand that never
 * rests must not leave the number old. */
const PAUSE_MS = 250;
const CAP_MS = 1000;

export interface LuxMeterHost {
    scene: SceneMirror;
    call(method: string, params: JsonObject): Promise<JsonObject>;
    onError(error: Error): void;
    online: ReadonlySignal<boolean>;
    /** An edit of this client is on its way. */
    busy: ReadonlySignal<boolean>;
    /** What is measured is the light of what this view shows. */
    solo: ReadonlySignal<readonly string[]>;
    viewId(): number | null;
    /** The server does not know yet what the view is to show. */
    viewUnsent(): boolean;
}

export class LuxMeter {
    readonly reading = signal<Reading | null>(null);
    /** False: the number is of another scene than the one there is. */
    readonly isCurrent = computed(() => {
        const lux = this.reading.value?.lux;
        const { scene, online, busy, solo } = this.host;
        const same = lux != null && lux.rev >= scene.rev.value && lux.solo.join() === solo.value.join();
        return same && online.value && !busy.value;
    });
    private readonly later = new Debounce(() => void this.measure(0), PAUSE_MS, CAP_MS);
    private running = false;

    constructor(private readonly host: LuxMeterHost) {
        effect(() => {
            void host.solo.value;
            if (host.scene.rev.value > 0 && host.online.value && this.reading.peek()) this.later.request();
        });
    }

    show(pick: Pick, carrierId: string | null): void {
        const record = carrierId ? this.host.scene.peek(carrierId) : undefined;
        const carrier = record ? { id: record.id, offset: sub(pick.point, anchorOf(record)) } : null;
        this.reading.value = { pick, carrier, lux: null };
        this.later.cancel();
        void this.measure(0);
    }

    hide(): void {
        this.reading.value = null;
        this.later.cancel();
    }

    /** Where the picked point is by now. */
    point({ pick, carrier }: Reading): Vec3 {
        const record = carrier && this.host.scene.record(carrier.id);
        return record ? add(anchorOf(record), carrier.offset) : pick.point;
    }

    /** One question at a time; one that comes meanwhile is asked after it. */
    private async measure(step: number): Promise<void> {
        const reading = this.reading.peek();
        if (!reading || !this.host.online.peek()) return;
        if (this.running || this.host.viewUnsent()) {
            this.later.request();
            return;
        }
        this.running = true;
        try {
            const lux = await this.probe(reading, SAMPLES[step]!);
            const now = this.reading.peek();
            if (now?.pick === reading.pick) this.reading.value = { ...now, lux };
            this.goOn(lux, step);
        } catch (error) {
            this.host.onError(error as Error);
        } finally {
            this.running = false;
        }
    }

    private goOn(lux: Lux, step: number): void {
        if (this.later.pending || step + 1 === SAMPLES.length || lux.stderr <= PRECISE * lux.value) return;
        setTimeout(() => {
            if (!this.later.pending) void this.measure(step + 1);
        }, PAUSE_MS);
    }

    private async probe(reading: Reading, samples: number): Promise<Lux> {
        const solo = this.host.solo.peek();
        const params: JsonObject = { point: [...this.point(reading)], normal: [...reading.pick.normal], samples };
        const viewId = this.host.viewId();
        if (viewId !== null) params.view_id = viewId;
        const r = await this.host.call('probe', params);
        return { value: numberOr(r.illuminance_lx, NaN), stderr: numberOr(r.stderr_lx, NaN), rev: numberOr(r.scene_rev, 0), solo };
    }
}
