/**
 * A second view of this session: what path tracing shows of the same light, from the same camera, at the same exposure. It is
 * there only while it is looked at, for both share the server's time. A moment of the past beside now is another such view, of the
 * same method.
 */
import { computed, effect, signal, type ReadonlySignal } from '@preact/signals';
import { Debounce } from '../lib/debounce';
import type { Frame, FrameHeader } from '../protocol/frame';
import type { Json, JsonObject } from '../protocol/rpc';
import type { CameraPose } from '../protocol/types';
import { Picture } from '../view/picture';
import { CameraNumbers } from './camera_seq';
import type { PictureFacts, Shot } from './compare';

/** A hand that moves the camera leaves all time to the picture that it looks at. */
const REST_MS = 300;
const NO_CAP_MS = Infinity;
/** It goes on when the picture beside it, of as many samples as the scene says, is done. */
export const REFERENCE_SPP = 4096;

/** What it is to show: of the view beside it. */
export interface Wanted {
    pose: CameraPose;
    /** Of view.open and view.update, all but the camera. */
    params: JsonObject;
    /** As they will be of its pictures. */
    facts: Pick<PictureFacts, 'ev' | 'map' | 'solo'>;
}

export interface ReferenceHost {
    call(method: string, params: JsonObject): Promise<JsonObject>;
    notify(method: string, params: JsonObject): void;
    onError(error: Error): void;
    /** There will be none. */
    onRefused(error: Error): void;
    /** '': that of the scene. */
    method?(): string;
    /** Whose numbers its cameras have. */
    kind?: 'reference' | 'moment';
    /** Somebody looks at it. */
    wanted: ReadonlySignal<boolean>;
    what: ReadonlySignal<Wanted>;
    canvas(): HTMLCanvasElement;
    /** In place of the browser's, for tests. */
    decode?(frame: Frame): Promise<ImageBitmap | null>;
}

export class Reference {
    /** null: no picture of what is wanted yet. */
    readonly shot = computed<Shot | null>(() => {
        const { facts, canvas } = this;
        return facts.value && canvas && { name: 'Reference', facts: facts.value, canvas };
    });
    private readonly facts = signal<PictureFacts | null>(null);
    /** There is a connection, and the view beside it is open. */
    private readonly ready = signal(false);
    private canvas: HTMLCanvasElement | null = null;
    private picture: Picture | null = null;
    private viewId: number | null = null;
    private opening = false;
    private readonly numbers: CameraNumbers;
    private acked = { seq: 0, arrivedAt: 0 };
    private told = '';
    /** What the open view was given: an update leaves it as it is where it does not name it. */
    private given = new Set<string>();
    /** What the server was asked for, by camera_seq. */
    private readonly asked = new Map<number, Wanted>();
    private readonly later = new Debounce(() => void this.update(), REST_MS, NO_CAP_MS);

    constructor(private readonly host: ReferenceHost) {
        this.numbers = new CameraNumbers(host.kind ?? 'reference');
        effect(() => {
            if (host.wanted.value && this.ready.value) void this.open();
            else void this.close();
        });
        effect(() => {
            const key = keyOf(host.what.value);
            if (this.viewId === null || key === this.told) return;
            this.facts.value = null; // what it shows is not what is wanted any more
            this.later.request();
        });
    }

    /** On a new connection, once the view beside it is open. */
    begin(): void {
        this.ready.value = true;
    }

    /** The connection is gone, and all views with it. */
    closed(): void {
        this.viewId = null;
        this.ready.value = false;
    }

    /** Frames may overtake the reply that names their view. */
    owns(viewId: number, cameraSeq: number): boolean {
        return (this.viewId === null ? this.opening : viewId === this.viewId) && this.numbers.has(cameraSeq);
    }

    receive(frame: Frame): void {
        this.picture?.receive(frame);
    }

    /** A hidden page showed nothing, and the server waits. */
    acknowledge(): void {
        const { seq, arrivedAt } = this.acked;
        if (this.viewId !== null && seq > 0) this.host.notify('frame.ack', { view_id: this.viewId, frame_seq: seq, held_ms: performance.now() - arrivedAt });
    }

    private async open(): Promise<void> {
        if (this.viewId !== null || this.opening) return;
        this.opening = true;
        this.given.clear();
        this.canvas ??= this.host.canvas();
        const onBroken = (h: FrameHeader, at: number, error: Error): void => this.broke(h, at, error);
        this.picture = new Picture(this.canvas, { onDrawn: (h, at) => this.drawn(h, at), onBroken }, this.host.decode);
        this.acked = { seq: 0, arrivedAt: 0 };
        this.numbers.begin();
        try {
            const reply = await this.host.call('view.open', { ...this.params(), ...(this.method() ? { method: this.method() } : {}), spp: REFERENCE_SPP, stats: false });
            this.viewId = Number(reply.view_id);
            this.acknowledge();
        } catch (error) {
            this.opening = false;
            this.host.onRefused(error as Error);
            return;
        }
        this.opening = false;
        if (!this.host.wanted.peek()) void this.close();
        else if (keyOf(this.host.what.peek()) !== this.told) this.later.request();
    }

    private async close(): Promise<void> {
        const { viewId } = this;
        this.later.cancel();
        if (this.opening) return; // open() looks at it again
        this.viewId = null;
        this.facts.value = null;
        this.picture?.reset();
        this.asked.clear();
        if (viewId !== null && this.ready.peek()) await this.host.call('view.close', { view_id: viewId }).catch(this.host.onError);
    }

    private async update(): Promise<void> {
        if (this.viewId === null) return;
        const named = namesIn(this.host.what.peek().params);
        if ([...this.given].some((name) => !named.has(name))) {
            await this.close();
            await this.open();
            return;
        }
        await this.host.call('view.update', { view_id: this.viewId, ...this.params() }).catch(this.host.onError);
    }

    private method(): string {
        return this.host.method?.() ?? 'path';
    }

    private params(): JsonObject {
        const what = this.host.what.peek();
        this.told = keyOf(what);
        for (const name of namesIn(what.params)) this.given.add(name);
        const seq = this.numbers.next();
        this.asked.set(seq, what);
        return { ...what.params, camera: what.pose as unknown as Json, camera_seq: seq };
    }

    private shown(h: FrameHeader, arrivedAt: number): void {
        this.acked = { seq: h.frameSeq, arrivedAt };
        if (!document.hidden) this.acknowledge();
    }

    private broke(h: FrameHeader, arrivedAt: number, error: Error): void {
        this.shown(h, arrivedAt); // or nothing would come any more
        this.host.onError(error);
    }

    private drawn(h: FrameHeader, arrivedAt: number): void {
        const what = this.asked.get(h.cameraSeq);
        this.shown(h, arrivedAt);
        for (const seq of this.asked.keys()) if (seq < h.cameraSeq) this.asked.delete(seq);
        if (!what || h.cameraSeq !== this.numbers.last) return; // of what was wanted before
        this.facts.value = { ...what.facts, pose: what.pose, rev: h.sceneRev, method: this.method(), spp: h.spp, bound: h.error };
    }
}

/** Members, and effects by their own names: each is a choice that can be taken back. */
const namesIn = (params: JsonObject): Set<string> => new Set([...Object.keys(params), ...Object.keys((params.effects ?? {}) as JsonObject)]);

const keyOf = ({ pose, params }: Wanted): string => JSON.stringify([pose, params]);
