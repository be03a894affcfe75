/**
 * The value of a map of light under the pointer, or in the middle of the picture where there is none. It is read off the picture
 * by the server: what comes here was compressed.
 */
import { effect, signal, type ReadonlySignal } from '@preact/signals';
import type { JsonObject } from '../protocol/rpc';
import { stringOr } from '../protocol/types';

export interface Readout {
    /** In the middle, and not under the pointer. */
    middle: boolean;
    unit: string;
    /** null: there is none. */
    value: number | null;
    /** null: not known. */
    error: number | null;
}

/** Between two questions: a readout is read, and not played. */
const PAUSE_MS = 80;

export interface ReadoutHost {
    call(method: string, params: JsonObject): Promise<JsonObject>;
    /** A map of light is shown. */
    wanted: ReadonlySignal<boolean>;
    /** Which map it is. */
    map: ReadonlySignal<string>;
    online: ReadonlySignal<boolean>;
    /** Changes with every picture. */
    frame: ReadonlySignal<unknown>;
    viewId(): number | null;
    size(): readonly [number, number];
}

export class Reader {
    readonly readout = signal<Readout | null>(null);
    /** Fractions of the picture; null: the pointer is elsewhere. */
    private readonly place = signal<readonly [number, number] | null>(null);
    private running = false;
    private again = false;

    constructor(private readonly host: ReadoutHost) {
        effect(() => {
            void host.frame.value;
            void this.place.value;
            if (host.wanted.value && host.online.value) void this.read();
            else this.readout.value = null;
        });
        // Of another map it is a value in another unit.
        effect(() => {
            void host.map.value;
            this.readout.value = null;
        });
    }

    /** null: it left. */
    pointAt(place: readonly [number, number] | null): void {
        this.place.value = place;
    }

    /** One question at a time; the newest place is asked next. */
    private async read(): Promise<void> {
        this.again = this.running;
        const viewId = this.host.viewId();
        if (this.running || viewId === null) return;
        this.running = true;
        try {
            const place = this.place.peek();
            const [x, y] = place ?? [0.5, 0.5];
            const [w, h] = this.host.size();
            const at = (part: number, n: number): number => Math.min(n - 1, Math.max(0, Math.floor(part * n)));
            const map = this.host.map.peek();
            const r = await this.host.call('view.read', { view_id: viewId, x: at(x, w), y: at(y, h) });
            if (this.host.wanted.peek() && map === this.host.map.peek()) this.readout.value = readoutOf(r, place === null);
        } catch {
            this.readout.value = null; // the view is being opened or closed, or has another size: the next frame asks anew
        }
        setTimeout(() => {
            this.running = false;
            if (this.again) void this.read();
        }, PAUSE_MS);
    }
}

function readoutOf(r: JsonObject, middle: boolean): Readout {
    const known = (v: unknown): number | null => (typeof v === 'number' && Number.isFinite(v) ? v : null);
    return { middle, unit: stringOr(r.unit, ''), value: known(r.value), error: known(r.error) };
}
