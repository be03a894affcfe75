import assert from 'node:assert/strict';
import { signal } from '@preact/signals';
import { test } from 'node:test';
import { FakeTimers } from '../lib/fake_timers';
import { Codec, Flag, Kind, type Frame } from '../protocol/frame';
import type { JsonObject } from '../protocol/rpc';
import type { CameraPose } from '../protocol/types';
import type { PictureFacts } from './compare';
import { Reference, type Wanted } from './reference';

const POSE: CameraPose = { position: [0, 1, 5], target: [0, 1, 0], up: [0, 1, 0], vfov_deg: 45 };
const WANTED: Wanted = { pose: POSE, params: { size: [8, 6], exposure_ev: 8 }, facts: { ev: 8, map: 'none', solo: [] } };
/** As the numbers of its cameras begin. */
const FIRST = 2 ** 30;
const settle = (): Promise<void> => new Promise((r) => setImmediate(r));

/** A frame without tiles but its last: nothing of it needs a browser. */
const frame = (frameSeq: number, cameraSeq: number, spp: number): Frame => ({
    header: {
        ...{ kind: Kind.tile, flags: Flag.lastTile, frameSeq, sceneRev: 2, viewId: 5, cameraSeq, x: 0, y: 0, w: 8, h: 6 },
        ...{ fullW: 8, fullH: 6, codec: Codec.png, quality: 100, downscale: 0, serverUs: 0, error: 0.1, spp },
    },
    payload: new Uint8Array(),
});

function made() {
    const calls: [string, JsonObject][] = [];
    const errors: string[] = [];
    const replies = { refuse: false, answer: (): void => undefined };
    const wanted = signal(false);
    const what = signal(WANTED);
    const context = { drawImage: () => undefined };
    const canvas = { width: 8, height: 6, dataset: {}, getContext: () => context } as unknown as HTMLCanvasElement;
    const call = (method: string, params: JsonObject): Promise<JsonObject> => {
        calls.push([method, params]);
        if (replies.refuse) return Promise.reject(new Error('no'));
        return new Promise((resolve) => {
            replies.answer = () => resolve({ view_id: 5 });
            if (method !== 'view.open') resolve({});
        });
    };
    const reference = new Reference({
        ...{ call, wanted, what, canvas: () => canvas },
        decode: () => Promise.resolve(null),
        notify: (method, params) => calls.push([method, params]),
        onError: (e) => errors.push(e.message),
        onRefused: (e) => errors.push(`refused: ${e.message}`),
    });
    const shown = (): PictureFacts | undefined => reference.shot.value?.facts;
    const names = (): string[] => calls.splice(0).map(([method]) => method);
    return { reference, wanted, what, calls, names, shown, errors, replies };
}

Object.assign(globalThis, { document: { hidden: false } });

test('the reference is a view of its own, of path, while somebody looks at it', async () => {
    const { reference, wanted, calls, names, shown, errors, replies } = made();
    wanted.value = true;
    assert.deepEqual(names(), [], 'there is no connection');
    reference.begin();
    const [method, params] = calls[0]!;
    assert.equal(method, 'view.open');
    assert.deepEqual([params.method, params.exposure_ev, params.camera], ['path', 8, POSE]);
    // A frame overtakes the reply.
    assert.ok(reference.owns(5, Number(params.camera_seq)));
    reference.receive(frame(1, Number(params.camera_seq), 1));
    await settle();
    const from = performance.now();
    while (performance.now() - from < 3) await settle();
    const waited = 3;
    replies.answer();
    await settle();
    assert.deepEqual(shown(), { ...WANTED.facts, pose: POSE, rev: 2, method: 'path', spp: 1, bound: 0.1 });
    const [ack, { held_ms: held, ...of }] = calls.pop()!;
    assert.deepEqual([ack, of], ['frame.ack', { view_id: 5, frame_seq: 1 }]);
    assert.ok(Number(held) >= waited, `it was held until the reply came, and not for ${Number(held)} ms`);
    assert.ok(!reference.owns(6, Number(params.camera_seq)));
    names();
    wanted.value = false;
    assert.deepEqual(calls, [['view.close', { view_id: 5 }]]);
    assert.equal(shown(), undefined);
    assert.deepEqual(errors, []);
});

test('while the camera moves it shows nothing, and is asked for once when the hand rests', async () => {
    const { reference, wanted, what, calls, names, shown, replies } = made();
    reference.begin();
    wanted.value = true;
    replies.answer();
    await settle();
    reference.receive(frame(1, FIRST, 1));
    await settle();
    assert.ok(shown());
    names();
    const timers = new FakeTimers();
    try {
        for (const vfov_deg of [46, 47, 48]) {
            what.value = { ...WANTED, pose: { ...POSE, vfov_deg } };
            timers.tick(100);
        }
        assert.equal(shown(), undefined);
        assert.deepEqual(names(), []);
        timers.tick(1000);
    } finally {
        timers.reset();
    }
    assert.deepEqual(calls.map(([m, p]) => [m, (p.camera as unknown as CameraPose).vfov_deg, p.camera_seq]), [['view.update', 48, FIRST + 1]]);
    reference.receive(frame(2, FIRST, 9)); // of the camera before
    await settle();
    assert.equal(shown(), undefined);
    reference.receive(frame(3, FIRST + 1, 1));
    await settle();
    assert.equal(shown()?.pose.vfov_deg, 48);
});

test('a view that is no longer wanted when it opens is closed; one that is refused is said to be', async () => {
    const { reference, wanted, names, errors, replies } = made();
    reference.begin();
    wanted.value = true;
    wanted.value = false;
    replies.answer();
    await settle();
    assert.deepEqual(names(), ['view.open', 'view.close']);
    replies.refuse = true;
    wanted.value = true;
    await settle();
    assert.deepEqual(errors, ['refused: no']);
});

test('a connection that breaks takes the view with it, and the next one opens it again', async () => {
    const { reference, wanted, names, shown, replies } = made();
    reference.begin();
    wanted.value = true;
    replies.answer();
    await settle();
    reference.closed();
    assert.deepEqual(names(), ['view.open']);
    assert.equal(shown(), undefined);
    reference.begin();
    assert.deepEqual(names(), ['view.open']);
});

test('a choice that is taken back is not kept by the view beside: it is opened anew, as an update cannot say so', async () => {
    const { reference, wanted, what, calls, names, replies } = made();
    const params = { ...WANTED.params, tone_map: 'aces', effects: { glossy: 'off', media: 'on' } };
    what.value = { ...WANTED, params };
    reference.begin();
    wanted.value = true;
    replies.answer();
    await settle();
    const change = (to: JsonObject): void => {
        const timers = new FakeTimers();
        try {
            what.value = { ...WANTED, params: to };
            timers.tick(1000);
        } finally {
            timers.reset();
        }
    };
    names();
    change({ ...params, tone_map: 'none' });
    await settle();
    assert.deepEqual(names(), ['view.update'], 'another choice is told');
    change({ ...params, effects: { glossy: 'off' } });
    await settle();
    assert.deepEqual(calls.map(([m, p]) => [m, p.effects]), [['view.close', undefined], ['view.open', { glossy: 'off' }]]);
    replies.answer();
    await settle();
    names();
    change(WANTED.params);
    await settle();
    assert.deepEqual(names(), ['view.close', 'view.open']);
});
