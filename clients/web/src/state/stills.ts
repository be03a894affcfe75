/**
 * Pictures that are made to be saved, in a view of their own: all around from where the camera stands, or what it sees in cd/m2.
 * The view is open only while it is worked at; the one on screen goes on beside it.
 */
import { signal, type ReadonlySignal } from '@preact/signals';
import { Canvas, readTile } from '../../../js/src/picture';
import { Flag, type Frame, type FrameHeader } from '../protocol/frame';
import type { Json, JsonObject } from '../protocol/rpc';
import type { CameraPose } from '../protocol/types';
import { Picture } from '../view/picture';
import { CameraNumbers } from './camera_seq';

export type StillKind = 'picture' | 'panorama';
export type StillFormat = 'png' | 'exr';

/** Of a panorama, which is half as high. The largest has as many pixels as a view may have. */
export const PANORAMA_WIDTHS = [2048, 4096, 1024] as const;

/** Enough for eyes: whichever comes first ends it. */
const ENOUGH_SPP = 256;
const ENOUGH_ERROR = 0.02;

export interface StillProgress {
    kind: StillKind;
    format: StillFormat;
    /** Of the last whole frame; 0: none, or a rough one. */
    spp: number;
    /** Relative, at most; null: not known. */
    error: number | null;
}

export interface StillsHost {
    call(method: string, params: JsonObject): Promise<JsonObject>;
    notify(method: string, params: JsonObject): void;
    onError(error: Error): void;
    announce(text: string): void;
    online: ReadonlySignal<boolean>;
    pose(): CameraPose;
    /** Of view.open: as the view on screen shows its picture, but for camera, method and quality. */
    params(): JsonObject;
    /** Of the view on screen, as fine as it gets. */
    restSize(): readonly [number, number];
    /** Of the view on screen; null: the scene's. */
    method(): string | null;
    /** It gets better, and may be held to an error. */
    addsSamples(): boolean;
    canvas(): HTMLCanvasElement;
    save(name: string, blob: Blob): void;
}

export class Stills {
    /** null: none is made. */
    readonly progress = signal<StillProgress | null>(null);
    private viewId: number | null = null;
    private opening = false;
    /** Which picture is made: what belongs to one before is not taken for it. */
    private turn = 0;
    private readonly numbers = new CameraNumbers('stills');
    private picture: Picture | null = null;
    private canvas: HTMLCanvasElement | null = null;
    private readonly linear = { canvas: new Canvas(), order: Promise.resolve() };
    private whole = false;

    constructor(private readonly host: StillsHost) {}

    async start(kind: StillKind, format: StillFormat, width: number): Promise<void> {
        const { host } = this;
        if (this.progress.value || !host.online.value) return;
        const turn = ++this.turn;
        this.progress.value = { kind, format, spp: 0, error: null };
        this.whole = false;
        this.linear.canvas = new Canvas();
        this.canvas = host.canvas();
        this.picture = new Picture(this.canvas, { onDrawn: (h, at) => this.drawn(h, at), onBroken: (_h, _at, error) => this.fail(error) });
        this.opening = true;
        this.numbers.begin();
        host.announce(`The ${kind} is being made`);
        try {
            const { view_id: id } = await host.call('view.open', this.params(kind, format, width));
            if (turn === this.turn) this.viewId = Number(id);
            else await this.closeView(Number(id)); // it was called off meanwhile
        } catch (error) {
            if (turn === this.turn) this.fail(error as Error);
        } finally {
            if (turn === this.turn) this.opening = false;
        }
    }

    private params(kind: StillKind, format: StillFormat, width: number): JsonObject {
        const { host } = this;
        const method = host.method();
        const camera = { ...host.pose(), projection: kind === 'panorama' ? 'panorama' : 'perspective' } as unknown as Json;
        return {
            ...host.params(),
            size: kind === 'panorama' ? [width, width / 2] : [...host.restSize()],
            ...(format === 'exr' ? { overlay: 'none' } : {}), // a map of light would be what its numbers mean
            ...(method === null ? {} : { method }),
            ...(host.addsSamples() ? { spp: ENOUGH_SPP, budget: { error: ENOUGH_ERROR } } : {}),
            ...{ camera, camera_seq: this.numbers.next(), codec: format === 'exr' ? 'half_deflate' : 'png', stats: false },
        };
    }

    /** Frames may overtake the reply that names their view. */
    owns(viewId: number, cameraSeq: number): boolean {
        return (this.viewId === null ? this.opening : viewId === this.viewId) && this.numbers.has(cameraSeq);
    }

    receive(frame: Frame): void {
        const { turn } = this;
        if (this.progress.value?.format === 'png') this.picture?.receive(frame);
        else this.linear.order = this.linear.order.then(() => this.take(frame)).catch((error: unknown) => (turn === this.turn ? this.fail(error as Error) : undefined));
    }

    private async take(frame: Frame): Promise<void> {
        const { canvas } = this.linear;
        const arrivedAt = performance.now();
        const tile = await readTile(frame);
        if (tile && canvas === this.linear.canvas && canvas.take(tile)) this.drawn(frame.header, arrivedAt);
    }

    /** Whoever waits for a file does not look: it goes on in a hidden page, too. */
    private drawn(h: FrameHeader, arrivedAt: number): void {
        const now = this.progress.value;
        if (!now) return;
        this.whole = true;
        this.progress.value = { ...now, spp: h.spp, error: h.error };
        this.host.notify('frame.ack', { view_id: h.viewId, frame_seq: h.frameSeq, held_ms: performance.now() - arrivedAt });
        if ((h.flags & Flag.converged) !== 0) void this.save();
    }

    /** As it is by now. */
    async save(): Promise<void> {
        const now = this.progress.value;
        if (!now || !this.whole) return;
        try {
            const file = now.format === 'exr' ? this.exr() : this.png(); // either has its pixels at once: the view may go
            this.cancel();
            this.host.save(`${now.kind}.${now.format}`, await file);
            this.host.announce(`Saved as ${now.kind}.${now.format}`);
        } catch (error) {
            this.host.onError(error as Error);
        }
    }

    cancel(): void {
        const { viewId } = this;
        this.closed(false);
        if (viewId !== null) void this.closeView(viewId);
    }

    /** The connection is gone, and all views with it. */
    closed(lost = true): void {
        if (lost && this.progress.value) this.host.announce('The picture to save was lost with the connection');
        this.turn++;
        this.opening = false;
        this.viewId = null;
        this.progress.value = null;
        this.let();
    }

    private async exr(): Promise<Blob> {
        return new Blob([(await this.linear.canvas.picture(null).exr()) as BlobPart]);
    }

    private png(): Promise<Blob> {
        return new Promise((resolve, reject) =>
            this.canvas!.toBlob((blob) => (blob ? resolve(blob) : reject(new Error('The browser could not make a PNG of this picture'))), 'image/png'),
        );
    }

    private fail(error: Error): void {
        if (!this.progress.value) return;
        this.host.onError(error);
        this.cancel();
    }

    private async closeView(viewId: number): Promise<void> {
        if (this.host.online.peek()) await this.host.call('view.close', { view_id: viewId }).catch(this.host.onError);
    }

    private let(): void {
        this.picture?.reset();
        this.picture = this.canvas = null;
        this.linear.canvas = new Canvas();
    }
}
