/** The 64-byte little-endian header in front of every binary message (protocol/PROTOCOL.md has the table). */

export const HEADER_BYTES = 64;
const MAGIC = 0x464d554c; // "LUMF" read as a little-endian word
const VERSION = 1;
const ERROR_UNKNOWN = 65535;

export const Kind = { tile: 1, hdrTile: 2, fileChunk: 3 } as const;
export const Flag = { lastTile: 1, lossless: 2, converged: 4, key: 8 } as const;
export const Codec = { rgba8: 0, jpeg: 1, png: 2, webp: 3, halfDeflate: 4, vp9: 5 } as const;

export interface FrameHeader {
    kind: number;
    flags: number;
    /** Counters are 64 bits on the wire; as numbers they stay exact for 285 years at 1 MHz. */
    frameSeq: number;
    sceneRev: number;
    viewId: number;
    cameraSeq: number;
    x: number;
    y: number;
    w: number;
    h: number;
    fullW: number;
    fullH: number;
    codec: number;
    quality: number;
    downscale: number;
    /** Newest edit or camera in this frame, receipt to encoded, in microseconds. */
    serverUs: number;
    /** Relative error, upper bound; null: unknown. */
    error: number | null;
    spp: number;
}

export interface Frame {
    header: FrameHeader;
    payload: Uint8Array;
}

/** Throws a RangeError that says what is wrong; never reads outside the message. */
export function decodeFrame(message: ArrayBuffer): Frame {
    if (message.byteLength < HEADER_BYTES) throw new RangeError(`frame of ${message.byteLength} bytes has no header`);
    const view = new DataView(message);
    if (view.getUint32(0, true) !== MAGIC) throw new RangeError('frame does not start with LUMF');
    if (view.getUint8(4) !== VERSION) throw new RangeError(`frame version ${view.getUint8(4)}, expected ${VERSION}`);
    const headerLen = view.getUint16(6, true);
    const payloadLen = view.getUint32(12, true);
    if (headerLen < HEADER_BYTES || headerLen + payloadLen !== message.byteLength) {
        throw new RangeError(`frame lengths ${headerLen} + ${payloadLen} do not add up to ${message.byteLength}`);
    }
    const error = view.getUint16(60, true);
    const header: FrameHeader = {
        kind: view.getUint8(5),
        flags: view.getUint32(8, true),
        frameSeq: Number(view.getBigUint64(16, true)),
        sceneRev: Number(view.getBigUint64(24, true)),
        viewId: view.getUint32(32, true),
        cameraSeq: view.getUint32(36, true),
        x: view.getUint16(40, true),
        y: view.getUint16(42, true),
        w: view.getUint16(44, true),
        h: view.getUint16(46, true),
        fullW: view.getUint16(48, true),
        fullH: view.getUint16(50, true),
        codec: view.getUint8(52),
        quality: view.getUint8(53),
        downscale: view.getUint8(54),
        serverUs: view.getUint32(56, true),
        error: error === ERROR_UNKNOWN ? null : error / 10000,
        spp: view.getUint16(62, true),
    };
    return { header, payload: new Uint8Array(message, headerLen, payloadLen) };
}
