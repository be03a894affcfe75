import assert from 'node:assert/strict';
import { afterEach, beforeEach, test } from 'node:test';
import { Codec, Flag, Kind, type Frame } from '../protocol/frame';
import { PASSED_OVER, SILENT, readsVp9 } from './reads';
import { Video } from './video';

const chunk = (frameSeq: number, key = false, bytes: number[] = [1]): Frame => ({
    header: {
        ...{ kind: Kind.tile, flags: Flag.lastTile | (key ? Flag.key : 0), frameSeq, sceneRev: 1, viewId: 1, cameraSeq: 0, x: 0, y: 0, w: 8, h: 8 },
        ...{ fullW: 8, fullH: 8, codec: Codec.vp9, quality: 50, downscale: 0, serverUs: 0, error: null, spp: 1 },
    },
    payload: new Uint8Array(bytes),
});

interface Chunk {
    type: string;
    timestamp: number;
    data: Uint8Array;
}

function FakeChunk(this: object, of: Chunk): void {
    Object.assign(this, of);
}

/** Gives each picture when it is asked to, in order, as a browser's decoder does; a payload of 0 breaks it. */
class FakeDecoder {
    static all: FakeDecoder[] = [];
    state = 'unconfigured';
    chunks: Chunk[] = [];
    closedFrames: number[] = [];
    constructor(private readonly to: { output(frame: unknown): void; error(e: Error): void }) {
        FakeDecoder.all.push(this);
    }
    static isConfigSupported = (): Promise<{ supported: boolean }> => Promise.resolve({ supported: true });
    configure(): void {
        this.state = 'configured';
    }
    decode(c: Chunk): void {
        if (this.state !== 'configured') throw new Error('not configured');
        this.chunks.push(c);
    }
    give(): void {
        const c = this.chunks.shift()!;
        if (c.data[0] === 0) this.fail(new Error('corrupt'));
        else this.to.output({ timestamp: c.timestamp, close: () => this.closedFrames.push(c.timestamp) });
    }
    fail(error: Error): void {
        this.state = 'closed';
        this.to.error(error);
    }
    close(): void {
        this.state = 'closed';
    }
}

beforeEach(() => {
    FakeDecoder.all = [];
    Object.assign(globalThis, { VideoDecoder: FakeDecoder, EncodedVideoChunk: FakeChunk });
});
afterEach(() => {
    Reflect.deleteProperty(globalThis, 'VideoDecoder');
    Reflect.deleteProperty(globalThis, 'EncodedVideoChunk');
});

const outcome = (p: Promise<VideoFrame>): Promise<string> => p.then((f) => `frame ${f.timestamp}`, (e: unknown) => ((e as Error).name === PASSED_OVER ? PASSED_OVER : (e as Error).message));

test('chunks become pictures in their order, the first as a key', async () => {
    const video = new Video();
    const pictures = [video.decode(chunk(4, true)), video.decode(chunk(9)), video.decode(chunk(10))].map(outcome);
    const [decoder] = FakeDecoder.all;
    assert.deepEqual(decoder!.chunks.map((c) => [c.type, c.timestamp]), [['key', 4], ['delta', 9], ['delta', 10]]);
    for (let i = 0; i < 3; i++) decoder!.give();
    assert.deepEqual(await Promise.all(pictures), ['frame 4', 'frame 9', 'frame 10']);
    assert.equal(FakeDecoder.all.length, 1);
});

test('of a broken chunk and those behind it one says so, and a key chunk mends it', async () => {
    const video = new Video();
    const pictures = [video.decode(chunk(1, true)), video.decode(chunk(2, false, [0])), video.decode(chunk(3))].map(outcome);
    FakeDecoder.all[0]!.give();
    FakeDecoder.all[0]!.give();
    pictures.push(outcome(video.decode(chunk(4))));
    assert.deepEqual(await Promise.all(pictures), ['frame 1', 'corrupt', PASSED_OVER, PASSED_OVER]);
    const mended = outcome(video.decode(chunk(5, true)));
    FakeDecoder.all[1]!.give();
    assert.equal(await mended, 'frame 5');
    const next = outcome(video.decode(chunk(6)));
    FakeDecoder.all[1]!.give();
    assert.equal(await next, 'frame 6');
});

test('a decoder that the browser took back while nothing came is missed by the next chunk', async () => {
    const video = new Video();
    const first = outcome(video.decode(chunk(1, true)));
    FakeDecoder.all[0]!.give();
    assert.equal(await first, 'frame 1');
    FakeDecoder.all[0]!.fail(new Error('reclaimed'));
    assert.equal(await outcome(video.decode(chunk(2))), 'the decoder of video was closed');
    assert.equal(await outcome(video.decode(chunk(3))), PASSED_OVER);
});

test('after a close nothing is drawn of what came before, and a key chunk begins anew', async () => {
    const video = new Video();
    const lost = outcome(video.decode(chunk(1, true)));
    video.close();
    assert.equal(await lost, 'the picture is another');
    FakeDecoder.all[0]!.give(); // it was on its way
    assert.deepEqual(FakeDecoder.all[0]!.closedFrames, [1]);
    const next = outcome(video.decode(chunk(1, true)));
    FakeDecoder.all[1]!.give();
    assert.equal(await next, 'frame 1');
});

/** The clock of those who wait: each call of the function lets all that was set go by once. */
function clock(): { go(): void; put: () => void } {
    const { setTimeout: set, clearTimeout: clear } = globalThis;
    let waiting = new Map<number, () => void>();
    let n = 0;
    const go = (): void => {
        const due = waiting;
        waiting = new Map();
        for (const what of due.values()) what();
    };
    Object.assign(globalThis, { setTimeout: (what: () => void) => (waiting.set(++n, what), n), clearTimeout: (id: number) => waiting.delete(id) });
    return { go, put: () => Object.assign(globalThis, { setTimeout: set, clearTimeout: clear }) };
}

test('a decoder that takes chunks and gives nothing is given up', async () => {
    const { go, put } = clock();
    try {
        const video = new Video();
        const pictures = [video.decode(chunk(1, true)), video.decode(chunk(2)), video.decode(chunk(3))];
        const [decoder] = FakeDecoder.all;
        decoder!.give();
        go(); // a machine that slept finds the time gone by before it sees what came
        decoder!.give();
        go();
        assert.equal(decoder!.state, 'configured');
        go();
        assert.equal(decoder!.state, 'closed');
        const names = await Promise.all(pictures.map((p) => p.then((f) => f.timestamp, (e: unknown) => (e as Error).name)));
        assert.deepEqual(names, [1, 2, SILENT]);
        const mended = video.decode(chunk(4, true));
        FakeDecoder.all[1]!.give();
        for (let i = 0; i < 3; i++) go(); // nothing is awaited
        assert.equal((await mended).timestamp, 4);
        assert.equal(FakeDecoder.all[1]!.state, 'configured');
    } finally {
        put();
    }
});

test('VP9 is read where the browser says so', async () => {
    assert.equal(await readsVp9(), true);
    FakeDecoder.isConfigSupported = () => Promise.resolve({ supported: false });
    assert.equal(await readsVp9(), false);
    FakeDecoder.isConfigSupported = () => Promise.reject(new TypeError('what is it'));
    assert.equal(await readsVp9(), false);
    Reflect.deleteProperty(globalThis, 'VideoDecoder');
    assert.equal(await readsVp9(), false);
});
