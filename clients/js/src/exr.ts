/** An OpenEXR file of a picture: one part, scan lines, channels B G R as half floats (openexr.com, "OpenEXR File Layout"). */
import { joined, through } from './streams.js';

const ZIP = 3;
/** Of a block that ZIP packs together. */
const ROWS = 16;
const HALF = 1;
/** Primaries and white of Rec.709. */
const REC709 = [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329];

const text = (s: string): Uint8Array => new TextEncoder().encode(`${s}\0`);
const ints = (...values: number[]): Uint8Array => littleEndian(values, (view, at, v) => view.setInt32(at, v, true));
const floats = (...values: number[]): Uint8Array => littleEndian(values, (view, at, v) => view.setFloat32(at, v, true));

function littleEndian(values: readonly number[], set: (view: DataView, at: number, v: number) => void): Uint8Array {
    const bytes = new Uint8Array(4 * values.length);
    values.forEach((v, i) => set(new DataView(bytes.buffer), 4 * i, v));
    return bytes;
}

const attribute = (name: string, type: string, value: Uint8Array): Uint8Array => joined([text(name), text(type), ints(value.length), value]);

function header(width: number, height: number): Uint8Array {
    const channels = ['B', 'G', 'R'].map((name) => joined([text(name), ints(HALF, 0, 1, 1)]));
    const window = ints(0, 0, width - 1, height - 1);
    return joined([
        Uint8Array.of(0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0), // magic, version
        attribute('channels', 'chlist', joined([...channels, Uint8Array.of(0)])),
        attribute('chromaticities', 'chromaticities', floats(...REC709)),
        attribute('compression', 'compression', Uint8Array.of(ZIP)),
        attribute('dataWindow', 'box2i', window),
        attribute('displayWindow', 'box2i', window),
        attribute('lineOrder', 'lineOrder', Uint8Array.of(0)),
        attribute('pixelAspectRatio', 'float', floats(1)),
        attribute('screenWindowCenter', 'v2f', floats(0, 0)),
        attribute('screenWindowWidth', 'float', floats(1)),
        attribute('whiteLuminance', 'float', floats(1)),
        Uint8Array.of(0),
    ]);
}

/** Rows y to y + n of each channel in turn, from pixels of RGB1. */
function planes(pixels: Uint8Array, width: number, y: number, n: number): Uint8Array {
    const block = new Uint8Array(6 * width * n);
    let to = 0;
    for (let row = y; row < y + n; row++) {
        for (const channel of [2, 1, 0]) {
            for (let x = 0, from = 8 * width * row + 2 * channel; x < width; x++, from += 8) {
                block[to++] = pixels[from]!;
                block[to++] = pixels[from + 1]!;
            }
        }
    }
    return block;
}

/** Low bytes before high ones, each as its difference from the last: what deflate finds repeated. */
function foretold(block: Uint8Array): Uint8Array {
    const half = (block.length + 1) >> 1;
    const sorted = new Uint8Array(block.length);
    for (let i = 0; i < block.length; i++) sorted[(i & 1 ? half : 0) + (i >> 1)] = block[i]!;
    for (let i = block.length - 1; i > 0; i--) sorted[i] = sorted[i]! - sorted[i - 1]! + 128;
    return sorted;
}

async function chunk(pixels: Uint8Array, width: number, y: number, n: number): Promise<Uint8Array> {
    const plain = planes(pixels, width, y, n);
    const packed = await through(foretold(plain), new CompressionStream('deflate'), Infinity);
    const data = packed.length < plain.length ? packed : plain; // a reader knows by the length
    return joined([ints(y, data.length), data]);
}

/** pixels: RGB1 half floats, little-endian, rows from the top. */
export async function exrFile(width: number, height: number, pixels: Uint8Array): Promise<Uint8Array> {
    const head = header(width, height);
    const chunks: Uint8Array[] = [];
    for (let y = 0; y < height; y += ROWS) chunks.push(await chunk(pixels, width, y, Math.min(ROWS, height - y)));
    const offsets = new Uint8Array(8 * chunks.length);
    let at = head.length + offsets.length;
    chunks.forEach((c, i) => {
        new DataView(offsets.buffer).setBigUint64(8 * i, BigInt(at), true);
        at += c.length;
    });
    return joined([head, offsets, ...chunks]);
}
