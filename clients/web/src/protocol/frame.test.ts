import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Codec, decodeFrame, Flag, HEADER_BYTES, Kind } from './frame';

/** The table of the protocol, field by field, at the offsets it gives. */
function message(payload: number[]): DataView {
    const v = new DataView(new ArrayBuffer(HEADER_BYTES + payload.length));
    v.setUint32(0, 0x4c554d46); // LUMF
    v.setUint8(4, 1);
    v.setUint8(5, Kind.tile);
    v.setUint16(6, HEADER_BYTES, true);
    v.setUint32(8, Flag.lastTile | Flag.converged, true);
    v.setUint32(12, payload.length, true);
    v.setBigUint64(16, 2n ** 40n + 7n, true);
    v.setBigUint64(24, 2n ** 33n + 5n, true);
    v.setUint32(32, 4000000001, true);
    v.setUint32(36, 4000000002, true);
    [10, 20, 128, 64, 1366, 768].forEach((n, i) => v.setUint16(40 + 2 * i, n, true));
    v.setUint8(52, Codec.png);
    v.setUint8(53, 85);
    v.setUint8(54, 1);
    v.setUint32(56, 123456, true);
    v.setUint16(60, 250, true);
    v.setUint16(62, 65535, true);
    payload.forEach((b, i) => v.setUint8(HEADER_BYTES + i, b));
    return v;
}

test('every field is read from its offset', () => {
    const { header, payload } = decodeFrame(message([1, 2, 3]).buffer as ArrayBuffer);
    assert.deepEqual(header, {
        kind: 1, flags: 5, frameSeq: 2 ** 40 + 7, sceneRev: 2 ** 33 + 5, viewId: 4000000001, cameraSeq: 4000000002,
        x: 10, y: 20, w: 128, h: 64, fullW: 1366, fullH: 768, codec: 2, quality: 85, downscale: 1,
        serverUs: 123456, error: 0.025, spp: 65535,
    });
    assert.deepEqual([...payload], [1, 2, 3]);
});

test('an unknown error is null', () => {
    const m = message([]);
    m.setUint16(60, 65535, true);
    assert.equal(decodeFrame(m.buffer as ArrayBuffer).header.error, null);
});

test('a longer header is skipped by its own length', () => {
    const m = message([0, 0, 0, 0, 9]);
    m.setUint16(6, HEADER_BYTES + 4, true);
    m.setUint32(12, 1, true);
    assert.deepEqual([...decodeFrame(m.buffer as ArrayBuffer).payload], [9]);
});

test('what is not a frame is refused', () => {
    const bad: [string, (m: DataView) => void][] = [
        ['magic', (m) => m.setUint8(0, 0)],
        ['version', (m) => m.setUint8(4, 2)],
        ['short header_len', (m) => m.setUint16(6, HEADER_BYTES - 1, true)],
        ['payload_len too large', (m) => m.setUint32(12, 4, true)],
        ['payload_len too small', (m) => m.setUint32(12, 2, true)],
        ['payload_len huge', (m) => m.setUint32(12, 0xffffffff, true)],
    ];
    for (const [what, spoil] of bad) {
        const m = message([1, 2, 3]);
        spoil(m);
        assert.throws(() => decodeFrame(m.buffer as ArrayBuffer), RangeError, what);
    }
    for (let n = 0; n < HEADER_BYTES; n++) assert.throws(() => decodeFrame(new ArrayBuffer(n)), RangeError);
});
