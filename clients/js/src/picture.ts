/** Pictures of a view, and the tiles that they come in (protocol/PROTOCOL.md, section 5). */
import { Codec, Flag, Kind, type Frame, type FrameHeader } from './frame.js';
import { exrFile } from './exr.js';
import type { FrameStats } from './records.js';
import { joined, through } from './streams.js';

const BYTES_PER_PIXEL: Readonly<Record<number, number>> = { [Codec.rgba8]: 4, [Codec.halfDeflate]: 8 };

export interface Tile {
    header: FrameHeader;
    /** RGBA bytes, or RGB1 half floats; rows from the top. */
    pixels: Uint8Array;
}

/** Null: of a kind that this client does not know. */
export async function readTile({ header, payload }: Frame): Promise<Tile | null> {
    const { kind, codec, downscale, x, y, w, h, fullW, fullH } = header;
    if (kind !== Kind.tile && kind !== Kind.hdrTile) return null;
    const side = 2 ** downscale; // of the square that each of its pixels covers
    const bytes = (BYTES_PER_PIXEL[codec] ?? NaN) * Math.ceil(w / side) * Math.ceil(h / side);
    const pixels = codec === Codec.halfDeflate ? await through(payload, new DecompressionStream('deflate'), bytes) : payload;
    if (pixels.length !== bytes || x + w > fullW || y + h > fullH) {
        throw new RangeError('a tile that does not fit its header');
    }
    return { header, pixels: downscale === 0 ? pixels : spread(pixels, header, side) };
}

/** Each pixel over the square that it covers. */
function spread(pixels: Uint8Array, { codec, w, h }: FrameHeader, side: number): Uint8Array {
    const size = BYTES_PER_PIXEL[codec]!;
    const columns = Math.ceil(w / side);
    const all = new Uint8Array(size * w * h);
    for (let y = 0; y < h; y++) {
        for (let x = 0; x < w; x++) {
            const from = size * (columns * Math.floor(y / side) + Math.floor(x / side));
            all.set(pixels.subarray(from, from + size), size * (w * y + x));
        }
    }
    return all;
}

/** What a view shows. The tiles of a frame come into it together, with its last: before that nothing of them shows. */
export class Canvas {
    private tiles: Tile[] = [];
    private pixels = new Uint8Array(0);
    private shown: FrameHeader | null = null;

    /** True: it completes a frame. */
    take(tile: Tile): boolean {
        const { header } = tile;
        if (this.tiles[0] && this.tiles[0].header.frameSeq !== header.frameSeq) this.tiles = []; // that one was cut off
        this.tiles.push(tile);
        if (!(header.flags & Flag.lastTile)) return false;
        if (header.fullW !== this.shown?.fullW || header.fullH !== this.shown.fullH || header.codec !== this.shown.codec) {
            this.pixels = new Uint8Array(BYTES_PER_PIXEL[header.codec]! * header.fullW * header.fullH);
        }
        this.tiles.forEach((t) => this.put(t));
        this.tiles = [];
        this.shown = header;
        return true;
    }

    private put({ header: { x, y, w, h, fullW, codec }, pixels }: Tile): void {
        const size = BYTES_PER_PIXEL[codec]!;
        for (let row = 0; row < h; row++) {
            this.pixels.set(pixels.subarray(size * w * row, size * w * (row + 1)), size * (fullW * (y + row) + x));
        }
    }

    /** The last whole frame. */
    picture(stats: FrameStats | null): Picture {
        if (!this.shown) throw new Error('no frame is complete yet');
        return new Picture(this.shown, this.pixels.slice(), stats);
    }
}

/** Of a half float: 1 bit of sign, 5 of exponent, 10 of fraction. */
function fromHalf(bits: number): number {
    const sign = bits & 0x8000 ? -1 : 1, exponent = (bits >> 10) & 31, fraction = bits & 1023;
    if (exponent === 31) return fraction ? NaN : sign * Infinity;
    return sign * (exponent ? (1 + fraction / 1024) * 2 ** (exponent - 15) : fraction * 2 ** -24);
}

/** What a view showed at one moment. Rows from the top. */
export class Picture {
    readonly width: number;
    readonly height: number;
    /** Pixels are cd/m2 in linear Rec.709 (of the overlay illuminance: illuminance / pi), not bytes as a screen shows them. */
    readonly linear: boolean;
    readonly sceneRev: number;
    readonly converged: boolean;

    constructor(
        header: FrameHeader,
        private readonly bytes: Uint8Array,
        /** Null: the view was opened without. */
        readonly stats: FrameStats | null,
    ) {
        this.width = header.fullW;
        this.height = header.fullH;
        this.linear = header.codec === Codec.halfDeflate;
        this.sceneRev = header.sceneRev;
        this.converged = (header.flags & Flag.converged) !== 0;
    }

    /** R G B A of each pixel, as a screen shows it: for new ImageData(picture.rgba(), picture.width). */
    rgba(): Uint8ClampedArray<ArrayBuffer> {
        if (this.linear) throw new TypeError('a linear picture has no colours of a screen: open the view without linear');
        return new Uint8ClampedArray(this.bytes);
    }

    /** R G B of each pixel of a linear picture, cd/m2. */
    radiance(): Float32Array {
        if (!this.linear) throw new TypeError('only views opened with linear: true tell cd/m2');
        const halves = new DataView(this.bytes.buffer);
        const rgb = new Float32Array(3 * this.width * this.height);
        for (let i = 0; i < rgb.length; i++) rgb[i] = fromHalf(halves.getUint16(8 * Math.floor(i / 3) + 2 * (i % 3), true));
        return rgb;
    }

    /** cd/m2 of each pixel of a linear picture. */
    luminance(): Float32Array {
        const rgb = this.radiance();
        return Float32Array.from({ length: rgb.length / 3 }, (_, i) => 0.2126 * rgb[3 * i]! + 0.7152 * rgb[3 * i + 1]! + 0.0722 * rgb[3 * i + 2]!);
    }

    /** The file's bytes: OpenEXR, half floats, ZIP; Y = 1 stands for 1 cd/m2. */
    exr(): Promise<Uint8Array> {
        if (!this.linear) throw new TypeError('only views opened with linear: true tell cd/m2');
        return exrFile(this.width, this.height, this.bytes);
    }

    /** The file's bytes. */
    async png(): Promise<Uint8Array> {
        const pixels = this.rgba();
        const rows = new Uint8Array((4 * this.width + 1) * this.height); // before each row the filter: none
        for (let y = 0; y < this.height; y++) {
            rows.set(pixels.subarray(4 * this.width * y, 4 * this.width * (y + 1)), (4 * this.width + 1) * y + 1);
        }
        const head = new Uint8Array(13);
        new DataView(head.buffer).setUint32(0, this.width);
        new DataView(head.buffer).setUint32(4, this.height);
        head.set([8, 6], 8); // bits, RGBA
        const data = await through(rows, new CompressionStream('deflate'), Infinity);
        const signature = Uint8Array.of(0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a);
        return joined([signature, chunk('IHDR', head), chunk('IDAT', data), chunk('IEND', new Uint8Array(0))]);
    }
}

function chunk(name: string, data: Uint8Array): Uint8Array {
    const all = new Uint8Array(12 + data.length);
    const view = new DataView(all.buffer);
    view.setUint32(0, data.length);
    all.set(new TextEncoder().encode(name), 4);
    all.set(data, 8);
    view.setUint32(8 + data.length, crc32(all.subarray(4, 8 + data.length)));
    return all;
}

/** As PNG has it: the polynomial 0xedb88320, bits from the lowest. */
function crc32(bytes: Uint8Array): number {
    let crc = ~0;
    for (const byte of bytes) {
        crc ^= byte;
        for (let bit = 0; bit < 8; bit++) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
    }
    return ~crc >>> 0;
}
