import assert from 'node:assert/strict';
import { test } from 'node:test';
import { RpcError, type Json, type JsonObject } from '../protocol/rpc';
import type { SceneRecord } from '../protocol/types';
import { byLight, grouped, groupIntensity, groupStart, scaledTo } from './groups';
import { explainImport, idForAsset } from './imports';
import { isUnseen, asInModel, centreOf, colourOf, fluxOf, intensityOf, isAdjusted, isLamp, nameOf } from './lights';
import { legendOf, FrameMeter, placeOn, sharesOf } from './frame_meter';
import { anchorOf, anchoredAt, placementOf } from './placement';
import { SceneMirror, withField } from './scene';
import { STOPS, ViewLink, viewSize } from './view';

const OPS: Json[] = [
    { op: 'add', type: 'camera', id: 'main', position: [0, 0, 5], target: [0, 0, 0] },
    { op: 'add', type: 'light', id: 'key', kind: 'point', flux_lm: 800, on: true, position: [1, 2, 3] },
    { op: 'add', type: 'light', id: 'fill', kind: 'point', flux_lm: 100, on: false },
];

function mirror(): SceneMirror {
    const scene = new SceneMirror();
    scene.load(OPS, 5);
    return scene;
}

test('fields are set by path, without touching the old record', () => {
    const record: SceneRecord = { type: 'object', id: 'o', transform: { translate: [1, 2, 3] }, visible: true };
    assert.deepEqual(withField(record, '/transform/translate/1', 9)?.transform, { translate: [1, 9, 3] });
    assert.equal(withField(record, '/visible', null)?.visible, null);
    assert.deepEqual(record.transform, { translate: [1, 2, 3] });
    assert.deepEqual(withField(record, '', { visible: false }), { ...record, visible: false });
    assert.equal(withField(record, '', 3), null);
    for (const path of ['/', 'visible', '/transform/translate/3', '/transform/translate/x', '/visible/deeper/still']) {
        assert.equal(withField(record, path, 1), null, path);
    }
});

test('a field takes the place of its rivals', () => {
    const lamp: SceneRecord = { type: 'light', id: 'l', kind: 'point', cct_k: 2700, flux_lm: 800 };
    const coloured = withField(lamp, '/color', [1, 1, 1])!;
    assert.deepEqual(coloured, { ...lamp, color: [1, 1, 1], cct_k: null });
    assert.deepEqual(withField(coloured, '', { cct_k: 4000, color: null }), { ...lamp, cct_k: 4000, color: null });
    assert.equal(withField(lamp, '/intensity_cd', 5)?.flux_lm, null);
    assert.equal(withField(coloured, '/cct_k', null)?.color, coloured.color);
});

test('a scene is loaded and followed', () => {
    const scene = mirror();
    assert.deepEqual(scene.list('light').value, ['fill', 'key']);
    assert.ok(scene.apply([{ op: 'set', id: 'key', path: '/flux_lm', value: 400 }], 6));
    assert.equal(scene.record('key')?.flux_lm, 400);
    assert.ok(scene.apply([{ op: 'remove', id: 'fill' }, { op: 'add', type: 'light', id: 'new', kind: 'spot' }], 7));
    assert.deepEqual(scene.list('light').value, ['key', 'new']);
    assert.equal(scene.record('fill'), undefined);
    assert.equal(scene.rev.value, 7);
});

test('a gap or an op that does not fit asks for the whole scene again; an old one is ignored', () => {
    const scene = mirror();
    assert.equal(scene.apply([], 8), false);
    assert.equal(scene.apply([{ op: 'set', id: 'nobody', path: '/on', value: true }], 6), false);
    assert.equal(scene.apply([{ op: 'import', id: 'room', asset: 'room.glb' }], 6), false);
    assert.equal(scene.apply([{ op: 'remove', id: 'fill' }, { op: 'set', id: 'nobody', path: '/on', value: true }], 6), false);
    assert.deepEqual(scene.lamps.value, ['key'], 'none is listed that is gone, though the rest is not known yet');
    assert.equal(scene.apply([{ op: 'remove', id: 'key' }], 4), true);
    assert.ok(scene.record('key'));
    scene.load([...OPS, { op: 'import', id: 'room', asset: 'room.glb' }], 6);
    assert.deepEqual(scene.list('import').value, ['room']);
    assert.ok(scene.apply([{ op: 'set', id: 'room', path: '/transform', value: { translate: [1, 0, 0] } }], 7));
    assert.deepEqual(placementOf(scene.record('room')!)?.translate, [1, 0, 0]);
    assert.equal(scene.apply([{ op: 'remove', id: 'room' }], 8), false);
    scene.load(OPS, 8);
    assert.equal(scene.record('room'), undefined);
});

test('the user’s own value stays on screen while it travels, and falls back when refused', () => {
    const scene = mirror();
    scene.record('key');
    scene.expect('key', '/flux_lm', 300);
    assert.equal(scene.record('key')?.flux_lm, 300);
    scene.apply([{ op: 'set', id: 'key', path: '/flux_lm', value: 790 }], 6); // an older value of ours comes back
    assert.equal(scene.record('key')?.flux_lm, 300);
    scene.settle('key', '/flux_lm', 300, false);
    assert.equal(scene.record('key')?.flux_lm, 790);
    scene.expect('key', '/flux_lm', 200);
    scene.settle('key', '/flux_lm', 200, true);
    assert.equal(scene.record('key')?.flux_lm, 200);
});

test('the unit is the field that is set; its slider reaches the value', () => {
    const light = (fields: JsonObject): SceneRecord => ({ type: 'light', id: 'l', ...fields });
    assert.equal(intensityOf(light({ flux_lm: null, intensity_cd: 1400 })).unit.symbol, 'cd');
    const bright = intensityOf(light({ luminance_cd_m2: 1.6e9 }));
    assert.equal(bright.unit.max, 1.6e9);
    assert.equal(intensityOf(light({ illuminance_lx: 0.01 })).unit.min, 0.01);
});

test('an object that shines is a lamp, with the light that the server tells', () => {
    const scene = new SceneMirror();
    const emits = { flux_lm: 3000, luminance_cd_m2: 2600, area_m2: 0.36, color: [1, 1, 1], centre: [1, 2.8, 0], sides: 'both' };
    scene.load([...OPS, { op: 'add', type: 'object', id: 'room/panel', origin: 'room', mesh: 'm', material: 'glow', emits }], 5);
    assert.deepEqual(scene.lamps.value, ['fill', 'key', 'room/panel']);
    const panel = (): SceneRecord => scene.record('room/panel')!;
    assert.deepEqual([intensityOf(panel()).field, intensityOf(panel()).value, nameOf(panel())], ['flux_lm', 3000, 'panel']);
    assert.deepEqual([centreOf(panel()), isAdjusted(panel())], [[1, 2.8, 0], false]);
    scene.expect('room/panel', '/flux_lm', 300);
    assert.equal(intensityOf(panel()).value, 300);
    const dimmed = { 'room/panel': { flux_lm: 300, luminance_cd_m2: 260 } };
    assert.ok(scene.apply([{ op: 'set', id: 'room/panel', path: '/flux_lm', value: 300 }], 6, dimmed));
    scene.settle('room/panel', '/flux_lm', 300, true);
    assert.deepEqual(panel().emits, { ...emits, ...dimmed['room/panel'] });
    assert.ok(isAdjusted(panel()));
    const { value } = asInModel('room/panel') as { value: Json };
    scene.apply([{ op: 'set', id: 'room/panel', path: '', value }], 7, { 'room/panel': { flux_lm: 3000, color: [2, 0.5, 1] } });
    assert.deepEqual([intensityOf(panel()).value, colourOf(panel()).linear, isAdjusted(panel())], [3000, [2, 0.5, 1], false]);
    scene.apply([{ op: 'set', id: 'glow', path: '/emission_cd_m2', value: 0 }], 8, { 'room/panel': null });
    assert.equal(scene.rev.value, 7, 'a material that is not known: the scene is loaded again');
    scene.apply([], 8, { 'room/panel': null });
    assert.deepEqual([scene.lamps.value, isLamp(panel())], [['fill', 'key'], false]);
    scene.apply([], 9, { 'room/panel': emits });
    assert.ok(isLamp(panel()));
});

test('the flux of a light follows from its size where that is what it is told by', () => {
    const light = (kind: string, fields: JsonObject): number | null => fluxOf({ type: 'light', id: 'l', kind, ...fields });
    const close = (got: number | null, want: number): void => assert.ok(Math.abs(got! / want - 1) < 1e-12, `${got}, ${want}`);
    close(light('point', { intensity_cd: 100 }), 400 * Math.PI);
    close(light('spot', { intensity_cd: 100, inner_cone_deg: 90, outer_cone_deg: 90 }), 200 * Math.PI);
    close(light('quad', { luminance_cd_m2: 100, u: [2, 0, 0], v: [0, 0, 3] }), 600 * Math.PI);
    close(light('disc', { luminance_cd_m2: 100, radius: 2 }), 400 * Math.PI ** 2);
    close(light('sphere', { luminance_cd_m2: 100, radius: 2 }), 1600 * Math.PI ** 2);
    close(light('spot', { flux_lm: 7 }), 7);
    assert.deepEqual([light('environment', { luminance_cd_m2: 9 }), light('directional', { illuminance_lx: 9 })], [null, null]);
});

const panel = (id: string, group: string, flux: number, model = flux): SceneRecord => ({
    ...{ type: 'object', id, group, flux_lm: flux === model ? null : flux },
    emits: { flux_lm: flux, material_flux_lm: model, luminance_cd_m2: 1, area_m2: 1, sides: 'both' },
});

test('groups of several are ordered by the light that they give, then by name', () => {
    const records = [panel('a1', 'a', 1), panel('a2', 'a', 2), panel('c1', 'c', 9), panel('c2', 'c', 9), panel('b1', 'b', 3), panel('b2', 'b', 0)];
    records.push(panel('one', 'alone', 99), { type: 'light', id: 'key', kind: 'point', flux_lm: 5 });
    const find = (id: string): SceneRecord => records.find((r) => r.id === id)!;
    const { alone, groups } = grouped(records.map((r) => r.id), find);
    assert.deepEqual(alone, ['one', 'key']);
    assert.deepEqual(byLight(groups, (id) => fluxOf(find(id)) ?? 0).map(([name]) => name), ['c', 'a', 'b']);
});

test('a group is dimmed with the ratios of its lamps as they were', () => {
    const lamps: SceneRecord[] = [panel('a', 'g', 300, 600), panel('b', 'g', 100), { type: 'light', id: 'l', kind: 'point', intensity_cd: 10 }];
    const before = groupIntensity(lamps);
    assert.ok(Math.abs(before.value - (400 + 40 * Math.PI)) < 1e-9 && before.total && before.model === null);
    assert.equal(groupIntensity(lamps.slice(0, 2)).model, 700);
    const half = scaledTo(groupStart(lamps), before.value / 2);
    assert.deepEqual(half.map((f) => [f.id, f.path, f.value]), [['a', '/flux_lm', 150], ['b', '/flux_lm', 50], ['l', '/intensity_cd', 5]]);
    assert.deepEqual(scaledTo(groupStart([panel('a', 'g', 0), panel('b', 'g', 0)]), 10).map((f) => f.value), [5, 5]);
    const sun: SceneRecord = { type: 'light', id: 's', kind: 'directional', illuminance_lx: 800 };
    const mixed = groupIntensity([sun, ...lamps]);
    assert.deepEqual([mixed.value, mixed.unit.symbol, mixed.total], [800, 'lx', false]);
    assert.deepEqual(scaledTo(groupStart([sun, ...lamps]), 400).map((f) => f.value), [400, 150, 50, 5]);
});

test('a view is held to an error by methods that know theirs, and by no other', async () => {
    let addsSamples = true;
    const asked: JsonObject[] = [];
    const call = (_method: string, params: JsonObject): Promise<JsonObject> => {
        asked.push(params);
        return Promise.resolve({ view_id: 1 });
    };
    const view = new ViewLink(call, assert.ifError, () => addsSamples);
    for (const stop of Object.keys(STOPS) as (keyof typeof STOPS)[]) {
        view.settings.value = { ...view.settings.value, stop };
        await view.open();
    }
    assert.deepEqual(
        asked.map((params) => params.budget),
        [10, 0.1, 0.05, 0.02, 0.01, 0.005].map((error) => ({ error })).concat([{} as { error: number }]),
    );
    addsSamples = false;
    await view.open();
    assert.deepEqual(asked.at(-1)!.budget, {}, 'it takes back what the server would refuse');
});

test('a moment that is not kept any more makes way for now, opened with or changed to, and all else that was said with it is said again', async () => {
    const frames: (() => void)[] = [];
    let now = 0;
    Object.assign(globalThis, { window: { devicePixelRatio: 1 }, requestAnimationFrame: (f: (t: number) => void) => frames.push(() => f((now += 100))) });
    const settle = (): Promise<void> => new Promise((r) => setImmediate(r));
    for (const path of ['scene_rev', 'moment']) {
        const asked: [string, JsonObject][] = [];
        const told: string[] = [];
        const call = (method: string, params: JsonObject): Promise<JsonObject> => {
            asked.push([method, params]);
            const gone = typeof params.moment === 'number';
            return gone ? Promise.reject(new RpcError('what stood at revision 3 is not kept', -32000, 'not_found', path)) : Promise.resolve({ view_id: 1 });
        };
        const view = new ViewLink(call, (error) => told.push(error.message), () => true);
        view.change({ moment: 3, solo: ['key'] });
        await view.open();
        assert.deepEqual(asked.map(([method, { moment, solo }]) => [method, moment, solo]), [['view.open', 3, ['key']], ['view.open', null, ['key']]]);
        assert.deepEqual([view.viewId, view.settings.value.moment, told.length], [1, null, 1]);
        view.change({ moment: 3 });
        view.resize(30, 20, 1);
        for (let i = 0; i < frames.length; i++) {
            frames[i]!();
            await settle();
        }
        const [, again] = asked[3]!;
        assert.deepEqual([again.moment, again.size, view.settings.value.moment, told.length], [null, [30, 20], null, 2]);
    }
    const refused = new ViewLink(() => Promise.reject(new RpcError('no such method', -32000, 'not_found', 'method')), assert.ifError, () => true);
    refused.change({ moment: 3 });
    await assert.rejects(refused.open(), /no such method/);
    assert.equal(refused.settings.value.moment, 3);
});

test('a view has whole pixels, the window’s shape, and stays within the budget', () => {
    assert.deepEqual(viewSize(600, 400, 1, 1e6), [600, 400]);
    for (const [w, h, ratio] of [[1046, 692, 1], [390, 340, 3], [5000, 100, 2], [0, 0, 1]] as const) {
        const [x, y] = viewSize(w, h, ratio, 400000);
        assert.ok(Number.isInteger(x) && Number.isInteger(y) && x >= 1 && y >= 1 && x <= 4096 && x * y <= 400000);
        if (h > 0) assert.ok(Math.abs((x / y) * (h / w) - 1) < 2 / y, `${x}x${y}`);
    }
});

test('whatever places a record, it is put where it was asked to be, and nothing else of it changes', () => {
    const matrix = [0, 0, 2, 1, 0, 2, 0, 2, -2, 0, 0, 3, 0, 0, 0, 1];
    const transforms: Json[] = [null, {}, { scale: [2, 2, 2] }, { translate: [1, 2, 3], rotate_deg: [0, 90, 0] }, matrix];
    const records: SceneRecord[] = transforms.map((transform) => ({ type: 'object', id: 'o', transform }));
    records.push({ type: 'light', id: 'l', position: [1, 2, 3] }, { type: 'import', id: 'i' });
    for (const record of records) {
        const { path, value } = anchoredAt(record, [4.00049, 5, -6]);
        const moved = withField(record, path, value) ?? { ...record, transform: value };
        assert.deepEqual(anchorOf(moved), [4, 5, -6], JSON.stringify(record));
        const back = anchoredAt(moved, anchorOf(record));
        assert.deepEqual(anchorOf(withField(moved, back.path, back.value)!), anchorOf(record));
        assert.deepEqual(placementOf(moved)?.scale, placementOf(record)?.scale);
    }
    assert.deepEqual(anchoredAt(records[4]!, [4, 5, 6]).value, [0, 0, 2, 4, 0, 2, 0, 5, -2, 0, 0, 6, 0, 0, 0, 1]);
});

test('ids for imports are made of what ids may hold, and are new', () => {
    const taken = new Set(['big-room', 'big-room-2']);
    assert.equal(idForAsset('models/Big Room.glb', (id) => taken.has(id)), 'big-room-3');
    assert.equal(idForAsset('<b>.obj', () => false), 'b');
    assert.equal(idForAsset('???', () => false), 'import');
});

test('a failed import says what to do, and nothing of the protocol', () => {
    for (const app of ['not_found', 'invalid_value', 'import_failed', 'unsupported', 'busy', 'limit_exceeded', 'io']) {
        const text = explainImport(new RpcError('the file ended too early', -32000, app, 'ops/0/asset'), 'room.glb');
        assert.ok(!text.includes('ops/') && /^[A-ZT“].*\.$/.test(text), text);
    }
    assert.match(explainImport(new Error('connection lost'), 'room.glb'), /^Connection lost\. Try again/);
});

test('how a frame is coded is told, where the server tells it', () => {
    const meter = new FrameMeter();
    const frame = { ms: 20, passes: 1, rays: {}, effects: {} };
    meter.stats({ ...frame, codec: 'webp', quality: 50, line_bytes_s: 30000 });
    assert.equal(meter.server.value?.coding, 'webp 50');
    assert.equal(meter.server.value.lineBits, 240000);
    meter.stats({ ...frame, line_bytes_s: null });
    assert.equal(meter.server.value.coding, null);
    assert.equal(meter.server.value.lineBits, null);
});

test('light that is in no picture is told once there is enough of it', () => {
    const meter = new FrameMeter();
    const frame = { ms: 20, passes: 1, rays: {}, effects: {} };
    meter.stats({ ...frame, caustics: null });
    assert.equal(meter.server.value?.missing, null, 'not known yet');
    meter.stats({ ...frame, caustics: { share: 0.031, why: '3.1 % of the light of sun is in no picture', mend: 'Give it' } });
    assert.deepEqual(meter.server.value.missing, { why: '3.1 % of the light of sun is in no picture', mend: 'Give it' });
    meter.stats({ ...frame, caustics: { share: 0.001, why: '', mend: '' } });
    assert.equal(meter.server.value.missing, null);
});

test('what effects take of the time stands beside what they leave of the noise', () => {
    const meter = new FrameMeter();
    const effects = { direct: { on: true, ns: 1e6, noise: 0.03 }, glossy: { on: true, ns: 3e6, noise: 0.04 }, media: { on: false, ns: 0, noise: 0 } };
    meter.stats({ ms: 20, passes: 1, effects });
    const shares = sharesOf(meter.server.value!.effects);
    assert.deepEqual([...shares.values()].map((s) => [s.time, Number(s.noise!.toFixed(9))]), [[0.25, 0.36], [0.75, 0.64], [0, 0]]);
    meter.stats({ ms: 20, passes: 1, effects: { direct: { on: true, ns: 0, noise: null } } });
    assert.deepEqual(sharesOf(meter.server.value!.effects).get('direct'), { time: 0, noise: null });
});

test('what the colours of a map stand for is told, in steps or smooth', () => {
    const light = { unit: 'lx', scale: 'log', smooth: true, min: 10, max: 1000, limits: [10, 100, 1000], colors: ['#000000', '#ffffff'] };
    const legend = legendOf({ ...light, labels: [[3, 4, 100], [5, 6], 'seven'] })!;
    assert.deepEqual(legend.labels, [{ x: 3, y: 4, value: 100 }]);
    assert.deepEqual([5, 10, 100, 1000, 2000].map((lx) => placeOn(legend.scale!, lx)), [0, 0, 0.5, 1, 1]);
    assert.equal(placeOn({ ...legend.scale!, kind: 'linear', min: 0 }, 250), 0.25);
    assert.equal(legendOf({ ...light, smooth: false }), null, 'three limits part four colours');
    assert.equal(legendOf({ unit: 'relative', limits: [0.1], colors: ['#000000', '#ffffff'] })!.scale, null);
});

test('a frame that took no work says what it shows, and not that it took nothing', () => {
    const meter = new FrameMeter();
    const frame = { ms: 20, passes: 1, rays: { primary: 4000 }, effects: { direct: { on: true, rays: 7 } } };
    meter.stats({ ...frame, cache: { records: 90, created: 3, updated: 2, reused: 80, removed: 1, discarded: 0 }, method: 'live' });
    assert.equal(meter.server.value?.raysPerSecond, 200000);
    assert.deepEqual(meter.server.value.cache, { records: 90, created: 3, updated: 2, reused: 80, removed: 1 });
    meter.stats({ ms: 0, passes: 0, rays: { primary: 0 }, effects: {}, cache: { records: 0 }, overlay: { unit: 'relative', limits: [0.1], colors: ['#000000', '#ffffff'] }, in_view: 'nothing' });
    const { ms, raysPerSecond, effects, cache, legend, inView } = meter.server.value;
    assert.deepEqual([ms, raysPerSecond, effects[0]?.rays, cache.records], [20, 200000, 7, 90]);
    assert.deepEqual([legend?.colors.length, inView], [2, 'nothing']);
    assert.equal(meter.ticks.value, 1, 'and leaves no mark in the history');
    meter.stats({ ...frame, cache: { records: 0, created: 0, updated: 0, reused: 0, removed: 0, discarded: 0 } });
    assert.equal(meter.server.value.cache, null, 'a method without a cache');
});

test('lamps without an extent, while they are on, are in no picture', () => {
    const lamp = (more: JsonObject): SceneRecord => ({ type: 'light', id: 'l', ...more }) as SceneRecord;
    assert.deepEqual(['point', 'spot', 'directional', 'quad', 'ies', 'sun'].map((kind) => isUnseen(lamp({ kind }))), [true, true, true, false, false, false]);
    assert.deepEqual([isUnseen(lamp({ kind: 'point', on: false })), isUnseen(lamp({ kind: 'directional', diameter_deg: 0.5 })), isUnseen(undefined)], [false, false, false]);
});
