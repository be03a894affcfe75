import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Codec, Flag, Kind, type Frame, type FrameHeader } from '../protocol/frame';
import { Picture } from './picture';

const frame = (frameSeq: number, fields: Partial<FrameHeader> = {}): Frame => ({
    header: {
        ...{ kind: Kind.tile, flags: Flag.lastTile, frameSeq, sceneRev: 1, viewId: 1, cameraSeq: 0, x: 0, y: 0, w: 8, h: 8 },
        ...{ fullW: 8, fullH: 8, codec: Codec.png, quality: 100, downscale: 0, serverUs: 0, error: null, spp: 1, ...fields },
    },
    payload: new Uint8Array(),
});

function picture(decode: (f: Frame) => Promise<ImageBitmap | null>): { show: Picture; log: string[]; drawn: number[]; throwOn: Set<number>; unreadable: number[] } {
    const log: string[] = [];
    const unreadable: number[] = [];
    const drawn: number[] = [];
    const throwOn = new Set<number>();
    let current = 0;
    const context = {
        drawImage: (bitmap: { seq: number }) => {
            if (throwOn.has(bitmap.seq)) throw new Error('lost context');
            current = bitmap.seq;
            drawn.push(current);
        },
    };
    const canvas = { width: 0, height: 0, dataset: {}, getContext: () => context } as unknown as HTMLCanvasElement;
    const events = {
        onDrawn: (last: FrameHeader) => log.push(`drawn ${last.frameSeq}`),
        onBroken: (last: FrameHeader, _at: number, error: Error) => log.push(`broken ${last.frameSeq}: ${error.message}`),
        onUnreadable: (codec: number) => unreadable.push(codec),
    };
    return { show: new Picture(canvas, events, decode), log, drawn, throwOn, unreadable };
}

const bitmap = (f: Frame): ImageBitmap => ({ seq: f.header.frameSeq, close: () => undefined }) as unknown as ImageBitmap;
const settle = (): Promise<void> => new Promise((r) => setImmediate(r));

test('a frame with a tile that cannot be decoded is not said to be drawn, and the next one is', async () => {
    const { show, log, drawn } = picture((f) => (f.header.x === 4 ? Promise.reject(new Error('bad jpeg')) : Promise.resolve(bitmap(f))));
    show.receive(frame(1));
    show.receive(frame(2, { flags: 0 }));
    show.receive(frame(2, { x: 4 }));
    show.receive(frame(3));
    await settle();
    assert.deepEqual(log, ['drawn 1', 'broken 2: bad jpeg', 'drawn 3']);
    assert.deepEqual(drawn, [1, 2, 3], 'what could be decoded of it is shown');
});

test('the codec of a tile that cannot be decoded is told, and none for what could not be drawn', async () => {
    const { show, log, throwOn, unreadable } = picture((f) => (f.header.codec === Codec.webp ? Promise.reject(new Error('what is it')) : Promise.resolve(bitmap(f))));
    throwOn.add(1);
    show.receive(frame(1));
    show.receive(frame(2, { flags: 0, codec: Codec.webp }));
    show.receive(frame(2, { x: 4 }));
    await settle();
    assert.deepEqual(log, ['broken 1: lost context', 'broken 2: what is it']);
    assert.deepEqual(unreadable, [Codec.webp]);
});

test('a throw while drawing stops no later frame', async () => {
    const { show, log, throwOn } = picture((f) => Promise.resolve(bitmap(f)));
    throwOn.add(2);
    for (const seq of [1, 2, 3]) show.receive(frame(seq));
    await settle();
    assert.deepEqual(log, ['drawn 1', 'broken 2: lost context', 'drawn 3']);
});

test('what comes of a view that is gone is neither drawn nor broken', async () => {
    const { show, log } = picture(() => Promise.reject(new Error('bad')));
    show.receive(frame(1));
    show.reset();
    await settle();
    assert.deepEqual(log, []);
});
