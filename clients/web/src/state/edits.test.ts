import assert from 'node:assert/strict';
import { beforeEach, test } from 'node:test';
import { FakeTimers } from '../lib/fake_timers';
import { ClosedError, type Json, type JsonObject } from '../protocol/rpc';
import { stringOr, type Op } from '../protocol/types';
import { Edits } from './edits';
import { SceneMirror } from './scene';
import { addOf, isDone, sceneFile } from './scene_ops';
import { ViewLink } from './view';

interface Call {
    method: string;
    params: JsonObject;
    answer(result: JsonObject): void;
    refuse(error: Error): void;
}

let calls: Call[];
let frames: (() => void)[];
let scene: SceneMirror;
let edits: Edits;
let errors: Error[];
let allowed: boolean;

const call = (method: string, params: JsonObject): Promise<JsonObject> =>
    new Promise((answer, refuse) => calls.push({ method, params, answer, refuse }));
const settle = async (): Promise<void> => {
    for (let i = 0; i < 10; i++) await Promise.resolve();
};
/** Runs what waits for an animation frame. */
async function frame(): Promise<void> {
    frames.splice(0).forEach((f) => f());
    await settle();
}
const opsOf = (c: Call): Op[] => c.params.ops as unknown as Op[];

beforeEach(() => {
    [calls, frames, errors] = [[], [], []];
    allowed = true;
    let now = 0;
    Object.assign(globalThis, {
        window: { devicePixelRatio: 1 },
        requestAnimationFrame: (f: (t: number) => void) => frames.push(() => f((now += 100))),
    });
    scene = new SceneMirror();
    scene.load([{ op: 'add', type: 'light', id: 'key', kind: 'point', flux_lm: 800, position: [1, 2, 3] }], 5);
    edits = new Edits(scene, { call, onError: (e) => errors.push(e), onAccepted: () => undefined, mayEdit: () => allowed });
});

test('each undo step is said to begin before anything of it is sent', async () => {
    const log: string[] = [];
    const ask = (method: string): Promise<JsonObject> => {
        log.push(method);
        return Promise.resolve({});
    };
    edits = new Edits(scene, { call: ask, onError: (e) => errors.push(e), onAccepted: () => undefined, mayEdit: () => true, onStep: () => log.push('step') });
    edits.set('key', '/flux_lm', 1);
    edits.set('key', '/flux_lm', 2);
    await frame();
    edits.endGesture();
    await edits.undo();
    await edits.transaction([{ op: 'remove', id: 'key' }]);
    assert.deepEqual(log, ['step', 'scene.apply', 'step', 'scene.undo', 'step', 'scene.apply']);
});

test('a drag sends the newest values, two messages at most at a time', async () => {
    for (let v = 1; v <= 10; v++) {
        edits.set('key', '/flux_lm', v);
        await frame();
    }
    assert.deepEqual(calls.map((c) => (opsOf(c)[0] as { value: Json }).value), [1, 2]);
    assert.ok(edits.busy.value);
    calls[0]!.answer({ scene_rev: 6 });
    await settle();
    await frame();
    assert.deepEqual(calls.map((c) => (opsOf(c)[0] as { value: Json }).value), [1, 2, 10]);
    calls[1]!.answer({ scene_rev: 7 });
    calls[2]!.answer({ scene_rev: 8 });
    await settle();
    assert.equal(edits.busy.value, false);
    assert.equal(new Set(calls.map((c) => c.params.op_id)).size, 3);
    assert.equal(new Set(calls.map((c) => c.params.undo_group)).size, 1, 'one step of undo');
});

/** Two sent and one that waits, of one gesture, and a lamp that is added: then the connection breaks. */
async function breakUp(): Promise<void> {
    for (const v of [100, 200, 300]) {
        edits.set('key', '/flux_lm', v);
        await frame();
    }
    edits.endGesture();
    void edits.transaction([{ op: 'add', type: 'light', id: 'new', kind: 'point' }]);
    const underWay = [...calls];
    underWay.forEach((c) => c.refuse(new ClosedError('connection lost')));
    edits.drop();
    await settle();
    calls = [];
}
const lamp = (flux_lm: number): Json => ({ op: 'add', type: 'light', id: 'key', kind: 'point', flux_lm, position: [1, 2, 3] });

test('edits that vanished with the connection are counted by gesture, and sent once more with their newest values', async () => {
    await breakUp();
    assert.equal(scene.peek('key')?.flux_lm, 800, 'what is shown falls back');
    scene.load([lamp(100)], 6);
    assert.equal(edits.missing(), 2);
    const done = edits.resend();
    await settle();
    assert.deepEqual(opsOf(calls[0]!), [{ op: 'set', id: 'key', path: '/flux_lm', value: 300 }]);
    calls[0]!.answer({ scene_rev: 7 });
    await settle();
    assert.deepEqual(opsOf(calls[1]!).map((op) => [op.op, op.id]), [['add', 'new']]);
    calls[1]!.refuse(new ClosedError('again'));
    await done;
    edits.drop();
    assert.equal(edits.missing(), 0, 'not a third time');
    assert.deepEqual(errors, []);
});

test('what was told once, and not sent again, is not told when the connection breaks again', async () => {
    await breakUp();
    scene.load([lamp(100)], 6);
    assert.equal(edits.missing(), 2);
    edits.drop();
    scene.load([lamp(100)], 6);
    assert.equal(edits.missing(), 0);
});

test('what is in the scene already is neither counted nor doubled', async () => {
    await breakUp();
    scene.load([lamp(300), { op: 'add', type: 'light', id: 'new', kind: 'point' }], 9);
    assert.equal(edits.missing(), 0);
    await edits.resend();
    assert.deepEqual(calls, []);
});

test('an edit whose news came before the connection broke is not lost, whatever others did to it since', async () => {
    void edits.transaction([{ op: 'set', id: 'key', path: '/on', value: false }]);
    edits.arrived(stringOr(calls[0]!.params.op_id, ''));
    calls[0]!.refuse(new ClosedError('connection lost'));
    edits.drop();
    await settle();
    scene.load([lamp(1)], 9);
    assert.equal(edits.missing(), 0);
});

test('a hidden tab sends what was changed last, although it has no animation frames', async () => {
    const timers = new FakeTimers();
    edits.set('key', '/flux_lm', 5);
    timers.tick(250);
    await settle();
    timers.reset();
    assert.equal(calls.length, 1, 'no frame has run');
});

test('a view has two changes unanswered at most, and the newest wins', async () => {
    const view = new ViewLink(call, (e) => errors.push(e), () => true);
    const opened = view.open();
    calls.shift()!.answer({ view_id: 3 });
    await opened;
    const at = (distance: number): void => view.moveTo({ ...view.orbit.value, distance });
    for (let d = 1; d <= 20; d++) {
        at(d);
        await frame();
    }
    assert.equal(calls.length, 2);
    calls[0]!.answer({});
    await settle();
    await frame();
    assert.equal(calls.length, 3);
    const { position, target } = calls[2]!.params.camera as { position: number[]; target: number[] };
    assert.ok(Math.abs(Math.hypot(...position.map((p, i) => p - target[i]!)) - 20) < 1e-9, 'the newest camera');
    calls[1]!.refuse(new Error('refused'));
    await settle();
    assert.deepEqual(errors.map((e) => e.message), ['refused']);
    view.resend();
    await frame();
    assert.equal(calls[3]!.params.resend, true);
    assert.equal(calls[3]!.params.camera, undefined);
});

test('what a link takes back is as in the scene again: by a new view, as what an update leaves out stays', async () => {
    const view = new ViewLink(call, (e) => errors.push(e), () => false);
    const opened = view.open();
    calls[0]!.answer({ view_id: 3 });
    await opened;
    const shown = async (act: () => void): Promise<[string, JsonObject][]> => {
        const from = calls.length;
        act();
        await frame();
        calls.slice(from).forEach((c) => c.answer({ view_id: 4 }));
        await settle();
        return calls.slice(from).map((c) => [c.method, c.params]);
    };
    await shown(() => view.change({ effects: { glossy: 'off' } }));
    const [updated] = await shown(() => view.show(null, { effects: { media: 'on' } }));
    assert.deepEqual([updated![0], updated![1].effects], ['view.update', { glossy: 'auto', media: 'on' }]);
    for (const settings of [{ method: 'path' }, { toneMap: 'aces' }, { exposure: { auto: false, ev: 5 } }]) {
        await shown(() => view.change({ ...settings, effects: { glossy: 'on' } }));
        const before = view.viewId;
        const [closing, opening] = await shown(() => view.show(null, {}));
        assert.deepEqual([closing, opening![0], view.viewId], [['view.close', { view_id: before }], 'view.open', 4]);
        for (const name of ['method', 'tone_map', 'exposure_ev', 'effects']) assert.ok(!(name in opening![1]), `${name} is named`);
    }
    await shown(() => view.change({ method: 'path' }));
    const [other] = await shown(() => view.show(null, { method: 'live' }));
    assert.deepEqual([other![0], other![1].method], ['view.update', 'live']);
    assert.deepEqual(errors, []);
});

test('a browser that cannot read a tile of WebP asks for none any more', async () => {
    const view = new ViewLink(call, () => undefined, () => true);
    const open = async (): Promise<Json | undefined> => {
        const from = calls.length;
        const opened = view.open();
        calls[from]!.answer({ view_id: 3 });
        await opened;
        return calls[from]!.params.codecs;
    };
    assert.deepEqual(await open(), ['webp']);
    view.reads('webp', false);
    view.reads('webp', false);
    view.resend();
    await frame();
    const updates = calls.filter((c) => c.method === 'view.update');
    assert.deepEqual(updates.map((c) => [c.params.codecs, c.params.resend]), [[[], true]]);
    assert.deepEqual(view.likeParams(8, null).codecs, []);
    view.closed();
    assert.deepEqual(await open(), [], 'nor by another connection');
});

test('video is offered once the browser has said that it reads it, and not to views that rest', async () => {
    const view = new ViewLink(call, () => undefined, () => true);
    const opened = view.open();
    calls.at(-1)!.answer({ view_id: 3 });
    await opened;
    const from = calls.length;
    view.reads('vp9', true);
    view.reads('vp9', true);
    await frame();
    assert.deepEqual(calls.slice(from).map((c) => c.params.codecs), [['webp', 'vp9']]);
    assert.deepEqual(view.likeParams(8, null).codecs, ['webp']);
    view.reads('vp9', false);
    await frame();
    assert.deepEqual(calls.at(-1)!.params.codecs, ['webp']);
});

test('a view that was lost does not count what the old connection left unanswered', async () => {
    const view = new ViewLink(call, () => undefined, () => true);
    const open = async (): Promise<void> => {
        const opened = view.open();
        calls.at(-1)!.answer({ view_id: 1 });
        await opened;
    };
    await open();
    for (let d = 1; d <= 3; d++) {
        view.moveTo({ ...view.orbit.value, distance: d });
        await frame();
    }
    const old = calls.filter((c) => c.method === 'view.update');
    assert.equal(old.length, 2);
    view.closed();
    old.forEach((c) => c.refuse(new ClosedError('lost')));
    await settle();
    await open();
    for (let d = 1; d <= 3; d++) {
        view.moveTo({ ...view.orbit.value, distance: d });
        await frame();
    }
    assert.equal(calls.filter((c) => c.method === 'view.update').length, 4);
});

test('an op is done when the scene is as it would make it', () => {
    const record = { type: 'light', id: 'l', position: [1, 2, 3], on: true, flux_lm: null };
    const set = (path: string, value: Json): Op => ({ op: 'set', id: 'l', path, value });
    assert.ok(isDone(set('/on', true), record) && isDone(set('/position/1', 2), record) && isDone(set('', { on: true, group: null }), record));
    assert.ok(!isDone(set('/on', false), record) && !isDone(set('/position', [1, 2, 4]), record) && !isDone(set('', { on: false }), record));
    assert.ok(isDone({ op: 'remove', id: 'l' }, undefined) && !isDone({ op: 'remove', id: 'l' }, record));
    assert.ok(!isDone(set('/on', true), undefined));
});

test('a record is made again without what only the server tells, and a scene is a file of lines', () => {
    const record = { type: 'object', id: 'room/panel', origin: 'room', mesh: 'm', color: null, emits: { flux_lm: 3 }, photometry: { flux_lm: 4 } };
    assert.deepEqual(addOf(record, 'copy'), { op: 'add', type: 'object', id: 'copy', mesh: 'm' });
    const lines = sceneFile([{ op: 'add', id: 'a' }], 'two lamps').split('\n');
    assert.deepEqual(lines, ['{"lumend":1,"kind":"scene","title":"two lamps"}', '{"op":"add","id":"a"}', '']);
});

test('who may not edit sends nothing, and the scene shows no change', async () => {
    allowed = false;
    edits.setOnce('key', '/flux_lm', 1);
    await frame();
    assert.equal(await edits.transaction([{ op: 'remove', id: 'key' }]), false);
    assert.equal(await edits.undo(), false);
    assert.equal(await edits.redo(), false);
    assert.equal(calls.length, 0);
    assert.equal(edits.busy.value, false);
    assert.equal(scene.peek('key')!.flux_lm, 800);
});

test('where the session goes on, what nobody answered is sent again in its order, each under its own name', async () => {
    for (const v of [100, 200, 300]) {
        edits.set('key', '/flux_lm', v);
        await frame();
    }
    edits.endGesture();
    void edits.undo();
    const before = calls.map((c) => c.params.op_id);
    assert.deepEqual(calls.map((c) => c.method), ['scene.apply', 'scene.apply', 'scene.undo']);
    const underWay = [...calls];
    edits.drop();
    underWay.forEach((c) => c.refuse(new ClosedError('connection lost')));
    await settle();
    calls = [];
    edits.arrived(stringOr(before[0], '')); // was told when the connection was there again
    const done = edits.repeat();
    await settle();
    assert.deepEqual(calls.map((c) => [c.method, c.params.op_id, c.params.repeat]), [
        ['scene.apply', before[1], true],
        ['scene.undo', before[2], true],
        ['scene.apply', calls[2]!.params.op_id, true],
    ]);
    assert.deepEqual(opsOf(calls[2]!), [{ op: 'set', id: 'key', path: '/flux_lm', value: 300 }], 'it was never sent');
    const groups = calls.map((c) => c.params.undo_group);
    assert.ok(groups[0] && groups[0] === groups[2] && groups[1] === undefined, 'still one step of undo');
    calls.forEach((c) => c.answer({ scene_rev: 9 }));
    await done;
    assert.equal(edits.busy.value, false);
    assert.equal(edits.missing(), 0);
    assert.deepEqual(errors, []);
});

test('an undo is not sent to a server that knows nothing of it', async () => {
    void edits.undo();
    const underWay = [...calls];
    edits.drop();
    underWay.forEach((c) => c.refuse(new ClosedError('connection lost')));
    await settle();
    assert.equal(edits.missing(), 0);
});
