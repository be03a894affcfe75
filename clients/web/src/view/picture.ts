/**
 * The picture: tiles in, whole frames on a canvas.
 *
 * Tiles are decoded as they arrive. The frame's last tile sets off the drawing, which happens in one task: the browser shows
 * all of a frame or nothing of it. Only changed tiles are sent, so frames are drawn in order and none is left out. A tile
 * that cannot be decoded leaves the picture wrong until all of it is sent anew: such a frame is not reported as drawn.
 * Over thin lines a frame is a chunk of a video in place of tiles: it is decoded by what is loaded then.
 */
import { Codec, Flag, Kind, type Frame, type FrameHeader } from '../protocol/frame';
import type { Video } from './video';

/** What a frame or a tile of it was decoded to. */
export type Pixels = ImageBitmap | VideoFrame;

interface Tile {
    header: FrameHeader;
    pixels: Promise<Pixels | null>;
}

const MIME: Record<number, string> = {
    [Codec.jpeg]: 'image/jpeg',
    [Codec.png]: 'image/png',
    [Codec.webp]: 'image/webp',
};

/** The bytes are the picture: no alpha, no colour conversion. */
const OPTIONS: ImageBitmapOptions = { premultiplyAlpha: 'none', colorSpaceConversion: 'none' };

async function decode({ header, payload }: Frame): Promise<ImageBitmap | null> {
    if (header.codec === Codec.rgba8) {
        const width = Math.ceil(header.w / 2 ** header.downscale);
        return createImageBitmap(new ImageData(new Uint8ClampedArray(payload), width), OPTIONS);
    }
    const type = MIME[header.codec];
    if (!type) throw new RangeError(`tile codec ${header.codec} was not asked for`);
    return createImageBitmap(new Blob([payload as BlobPart], { type }), OPTIONS);
}

const asError = (error: unknown): Error => (error instanceof Error ? error : new Error(String(error)));

export interface PictureEvents {
    /** arrivedAt: when its last tile came, as performance.now() counts. */
    onDrawn(last: FrameHeader, arrivedAt: number): void;
    /** Something of the frame could not be shown, for this reason. */
    onBroken(last: FrameHeader, arrivedAt: number, error: Error): void;
    /** Before that: a tile could not be decoded. */
    onUnreadable?(codec: number): void;
}

type Decode = (frame: Frame) => Promise<Pixels | null>;

export class Picture {
    private tiles: Tile[] = [];
    private drawn: Promise<void> = Promise.resolve();
    private generation = 0;
    private video: Promise<Video> | null = null;

    constructor(
        private readonly canvas: HTMLCanvasElement,
        private readonly events: PictureEvents,
        private readonly decodeTile: Decode = decode,
    ) {}

    receive(frame: Frame): void {
        if (frame.header.kind !== Kind.tile) return;
        const pixels = frame.header.codec === Codec.vp9 ? this.decodeVideo(frame) : this.decodeTile(frame);
        pixels.catch(() => this.events.onUnreadable?.(frame.header.codec)); // draw() looks at it, later
        this.tiles.push({ header: frame.header, pixels });
        if ((frame.header.flags & Flag.lastTile) === 0) return;
        const { tiles, generation } = this;
        const arrivedAt = performance.now();
        this.tiles = [];
        // Whatever happens to one frame, the next is drawn.
        this.drawn = this.drawn.then(() => this.draw(tiles, generation, arrivedAt)).catch((error: unknown) => {
            if (generation === this.generation) this.events.onBroken(frame.header, arrivedAt, asError(error));
        });
    }

    /** A new connection or view: what was half received is worthless. */
    reset(): void {
        this.tiles = [];
        this.generation++;
        void this.video?.then((v) => v.close(), () => undefined);
    }

    /** Chunks that come while it is fetched are decoded after it has come, in their order. */
    private async decodeVideo(frame: Frame): Promise<Pixels> {
        this.video ??= import('./video').then((m) => new m.Video());
        this.video.catch(() => (this.video = null)); // it could not be fetched: the next chunk tries again
        return (await this.video).decode(frame);
    }

    private async draw(tiles: Tile[], generation: number, arrivedAt: number): Promise<void> {
        const decoded = await Promise.allSettled(tiles.map((t) => t.pixels));
        const pixels = decoded.map((d) => (d.status === 'fulfilled' ? d.value : null));
        const failure = decoded.find((d) => d.status === 'rejected');
        const last = tiles[tiles.length - 1]!.header;
        try {
            if (generation !== this.generation) return;
            this.resize(last.fullW, last.fullH);
            this.drawTiles(this.canvas.getContext('2d', { alpha: false })!, tiles, pixels);
            if (failure) throw failure.reason;
            // What is on screen, readable from outside: tests wait for it.
            Object.assign(this.canvas.dataset, { frame: last.frameSeq, rev: last.sceneRev, camera: last.cameraSeq });
            this.events.onDrawn(last, arrivedAt);
        } finally {
            for (const bitmap of pixels) bitmap?.close();
        }
    }

    /** Tiles that are stretched one by one show their edges: a frame that is all small is put together first. */
    private drawTiles(context: CanvasRenderingContext2D, tiles: Tile[], pixels: (Pixels | null)[]): void {
        const { fullW, fullH, downscale } = tiles[0]!.header;
        const n = tiles.every((t) => t.header.downscale === downscale) ? 2 ** downscale : 1;
        const small = n > 1 ? new OffscreenCanvas(Math.ceil(fullW / n), Math.ceil(fullH / n)) : null;
        const target = small?.getContext('2d') ?? context;
        tiles.forEach(({ header: { x, y, w, h } }, i) => {
            const bitmap = pixels[i];
            if (!bitmap) return;
            if (small) target.drawImage(bitmap, x / n, y / n);
            else target.drawImage(bitmap, x, y, w, h);
        });
        context.imageSmoothingQuality = 'high';
        if (small) context.drawImage(small, 0, 0, small.width * n, small.height * n); // untouched parts are transparent
    }

    /** Keeps the old picture, stretched, until the new size has been drawn. */
    private resize(w: number, h: number): void {
        if (this.canvas.width === w && this.canvas.height === h) return;
        this.canvas.width = w;
        this.canvas.height = h;
    }
}
