import assert from 'node:assert/strict';
import { test } from 'node:test';
import { signal } from '@preact/signals';
import { Debounce } from '../lib/debounce';
import { FakeTimers } from '../lib/fake_timers';
import { Once } from '../lib/once';
import { cross, dot, length, normalize, sub, type Vec3 } from '../lib/vec';
import type { JsonObject } from '../protocol/rpc';
import type { SceneRecord } from '../protocol/types';
import { aimed, aimedAt, aimOf, anglesOf, directionOf, edgesTowards, isAimed, KIND_NAMES, newLamp } from './lamp_make';
import { markedOf } from './lamps';
import { adaptedKelvin, intensityOf, kelvinOfAll, matches } from './lights';
import { inSight, layoutOf, linesOf } from './listing';
import { LuxMeter } from './luxmeter';
import { SceneMirror, withField } from './scene';
import { Toasts } from './toasts';

const near = (a: Vec3, b: Vec3, eps = 2e-4): void => assert.ok(length(sub(a, b)) < eps, `${a} and ${b}`);
const record = (fields: JsonObject): SceneRecord => ({ type: 'light', id: 'l', ...fields });

test('a lamp of any kind hangs under what was picked, shines away from it, and is bright enough to see', () => {
    for (const normal of [[0, -1, 0], [1, 0, 0], [0, 1, 0], normalize([1, -2, 3], [0, 1, 0])] as Vec3[]) {
        for (const kind of KIND_NAMES) {
            const lamp = record(newLamp(kind, { point: [1, 2, 3], normal }, 2, 8));
            assert.ok(intensityOf(lamp).value > 0 && intensityOf(lamp).value <= intensityOf(lamp).unit.max, kind);
            if (kind === 'directional') continue;
            if (isAimed(lamp)) near(aimOf(lamp), normal);
            const off = sub(lamp.position as unknown as Vec3, [1, 2, 3]);
            assert.ok(dot(off, normal) > 0 && dot(off, normal) < 0.5, `${kind} is ${off} off the surface`);
        }
    }
});

test('at twice the distance four times the flux', () => {
    const flux = (r: number): number => Number(newLamp('point', { point: [0, 0, 0], normal: null }, r, 8).flux_lm);
    assert.ok(Math.abs(flux(2) / flux(1) / 4 - 1) < 0.1, 'to two digits');
    assert.equal(flux(1), Number((Math.PI ** 2 * 256).toPrecision(2)));
});

test('the edges of a panel keep their lengths and span the plane across its aim', () => {
    for (const to of [[0, -1, 0], [0, 0, 1], [1, 0, 0], [0.3, -0.2, 0.9]] as Vec3[]) {
        const { u, v } = edgesTowards(to, 1.2, 0.3, [0, 1, 0]);
        assert.ok(Math.abs(length(u) - 1.2) < 1e-9 && Math.abs(length(v) - 0.3) < 1e-9 && Math.abs(dot(u, v)) < 1e-9);
        near(normalize(cross(u, v), [0, 0, 0]), normalize(to, [0, 0, 0]));
    }
});

test('spots, downlights, panels and lamps with a file point at what is picked', () => {
    const point: Vec3 = [2, 0.5, -1];
    const measured: JsonObject = { kind: 'ies', asset: 'a.ies', position: [0, 3, 0], direction: [0, -1, 0] };
    for (const fields of [...(['spot', 'disc', 'quad'] as const).map((kind) => newLamp(kind, { point: [0, 3, 0], normal: [0, -1, 0] }, 2, 8)), measured]) {
        const lamp = record(fields);
        assert.ok(isAimed(lamp));
        const op = aimedAt(lamp, point);
        assert.ok(op.op === 'set');
        const after = withField(lamp, op.path, op.value)!;
        near(aimOf(after), normalize(sub(point, lamp.position as unknown as Vec3), [0, 0, 0]));
    }
});

test('angles and directions are two ways to say the same', () => {
    for (const tilt of [0, 20, 90, 135, 180]) {
        for (const turn of [-170, -45, 0, 90]) {
            const angles = anglesOf(directionOf({ tilt, turn }));
            assert.ok(Math.abs(angles.tilt - tilt) < 1e-6, `${tilt} ${turn}`);
            if (tilt > 0 && tilt < 180) assert.ok(Math.abs(angles.turn - turn) < 1e-6, `${tilt} ${turn}`);
        }
    }
    const down = aimed(record({ kind: 'spot' }), directionOf({ tilt: 0, turn: 77 }));
    assert.deepEqual(down.op === 'set' && down.value, [0, -1, 0]);
});

test('of many lamps the nearest in the picture are marked, and the selected one always, on top', () => {
    const depth = (id: string): number | null => (id === 'out' ? null : Number(id.slice(1)));
    const ids = ['out', ...Array.from({ length: 300 }, (_, i) => `l${300 - i}`)];
    const marked = markedOf(ids, ['l299'], 48, depth);
    assert.equal(marked.length, 49);
    assert.equal(marked.at(-1), 'l299');
    assert.ok(Array.from({ length: 48 }, (_, i) => `l${i + 1}`).every((id) => marked.includes(id)));
    assert.deepEqual(markedOf(['a'], ['gone'], 48, () => 1), ['a']);
});

test('lamps are found by parts of name, group and kind', () => {
    const lamp = record({ id: 'hall/track-3', kind: 'spot', group: 'Gallery' });
    for (const words of [['track'], ['gallery'], ['spot'], ['hall', 'spot']]) assert.ok(matches(lamp, words), String(words));
    assert.ok(!matches(lamp, ['hall', 'sphere']));
});

test('the temperature of all lamps is that of their light together: what is off or coloured has no part', () => {
    const lamp = (fields: JsonObject): SceneRecord => record({ kind: 'point', ...fields });
    assert.equal(kelvinOfAll([lamp({ flux_lm: 100, cct_k: 2000 }), lamp({ flux_lm: 300, cct_k: 6000 })]), 4000);
    assert.equal(kelvinOfAll([lamp({ flux_lm: 100, cct_k: 2700 }), lamp({ flux_lm: 900, cct_k: 6000, on: false }), lamp({ flux_lm: 9, color: [1, 0, 0] })]), 2700);
    assert.equal(kelvinOfAll([lamp({ flux_lm: 9, color: [1, 0, 0] })]), null);
});

test('a view opens with most of the colour of the lamps taken for white, as eyes do, and none where daylight comes in', () => {
    const lamp = (fields: JsonObject): SceneRecord => record({ kind: 'point', flux_lm: 100, ...fields });
    for (const cct_k of [1900, 2700, 4000, 9000]) {
        const seen = adaptedKelvin([lamp({ cct_k }), lamp({ cct_k })])!;
        // CIECAM02: 1 - e^(-62/92) / 3.6 = 0.858 of the way from D65, in reciprocal kelvins; half a kelvin is rounded off.
        const way = (1e6 / seen - 1e6 / 6504) / (1e6 / cct_k - 1e6 / 6504);
        assert.ok(Math.abs(way - 0.8584) < 0.003, `${cct_k} K: ${seen} K, ${way}`);
    }
    assert.equal(adaptedKelvin([lamp({ cct_k: 6504 })]), 6504);
    const warm = lamp({ cct_k: 2700 });
    for (const kind of ['sky', 'sun', 'environment', 'directional']) assert.equal(adaptedKelvin([warm, record({ kind })]), null, kind);
    assert.notEqual(adaptedKelvin([warm, record({ kind: 'sun', on: false })]), null, 'at night');
    assert.equal(adaptedKelvin([warm, lamp({ flux_lm: 150 })]), null, 'of most of the light nobody knows');
    assert.equal(adaptedKelvin([]), null);
});

/** Lamps 0..n-1, every third in group "g". */
function listing(n: number, filter = '', open = true): ReturnType<typeof linesOf> {
    const records = Array.from({ length: n }, (_, i) => record({ id: `lamp-${i}`, kind: 'point', flux_lm: 1, group: i % 3 ? null : 'g' }));
    const find = (id: string): SceneRecord => records.find((r) => r.id === id)!;
    return linesOf({ ids: records.map((r) => r.id), record: find, filter, lumens: () => 1, isOpen: () => open });
}

test('every one of 300 lamps has a line', () => {
    const { lines, n } = listing(300);
    assert.equal(n, 300);
    assert.equal(lines.filter((l) => 'id' in l).length, 300);
    assert.equal(lines.filter((l) => 'group' in l).length, 1);
    assert.equal(listing(300, '', false).lines.length, 201, 'a closed group is one line');
    assert.deepEqual(listing(300, 'lamp-299').lines.map((l) => l.key), ['group g', 'lamp-299'].slice(299 % 3 === 0 ? 0 : 1));
    assert.equal(listing(300, 'lamp g', false).lines.length, 101, 'what was searched for is open');
});

test('of a long list only what is in sight is drawn, and what must stay', () => {
    const layout = layoutOf([...Array(300).keys()].map((i) => (i === 10 ? 400 : 50)));
    assert.equal(layout.height, 299 * 50 + 400);
    assert.equal(layout.tops[11], 900);
    const shown = inSight(layout, 500, 1000, [0, 299, -1]);
    assert.deepEqual(shown, [0, 10, 11, 12, 299]);
});

test('a job that is put off again and again runs all the same', () => {
    const timers = new FakeTimers();
    let now = 0;
    let runs = 0;
    const job = new Debounce(() => runs++, 250, 1000, () => now);
    for (let i = 0; i < 60; i++) {
        job.request();
        now += 50;
        timers.tick(50);
    }
    assert.equal(runs, 3, 'in three seconds');
    now += 250;
    timers.tick(250);
    assert.equal(runs, 3);
    job.request();
    timers.tick(249);
    assert.equal(runs, 3);
    timers.tick(1);
    assert.equal(runs, 4);
    timers.reset();
});

test('what is asked for while it runs is done once more, and no oftener', async () => {
    let runs = 0;
    const ends: (() => void)[] = [];
    const once = new Once(() => new Promise((end) => (runs++, ends.push(end))));
    const all = [once.run(), once.run(), once.run(), once.run()];
    assert.equal(runs, 1);
    ends[0]!();
    await all[0];
    await Promise.resolve();
    await Promise.resolve();
    await new Promise((r) => setImmediate(r));
    assert.equal(runs, 2);
    ends[1]!();
    await Promise.all(all);
    assert.equal(runs, 2);
});

test('a reading is old at once when the scene changes, while an edit travels, and without a connection', async () => {
    const timers = new FakeTimers();
    const scene = new SceneMirror();
    scene.load([{ op: 'add', type: 'light', id: 'key', kind: 'point', flux_lm: 8 }], 5);
    const online = signal(true);
    const busy = signal(false);
    const asked: JsonObject[] = [];
    const call = (_: string, params: JsonObject): Promise<JsonObject> => {
        asked.push(params);
        return Promise.resolve({ illuminance_lx: 500, stderr_lx: 1, scene_rev: scene.rev.peek() });
    };
    const solo = signal<readonly string[]>([]);
    let unsent = false;
    const view = { viewId: () => 7, viewUnsent: () => unsent };
    const meter = new LuxMeter({ scene, call, onError: assert.ifError, online, busy, solo, ...view });
    const settle = async (): Promise<void> => {
        for (let i = 0; i < 10; i++) await Promise.resolve();
    };
    meter.show({ id: 'floor', point: [0, 0, 0], normal: [0, 1, 0], distance: 3 }, null);
    await settle();
    assert.equal(meter.reading.value?.lux?.rev, 5);
    assert.ok(meter.isCurrent.value);
    scene.apply([{ op: 'set', id: 'key', path: '/flux_lm', value: 4 }], 6); // of somebody else
    assert.equal(meter.isCurrent.value, false, 'at once, not when it is measured again');
    assert.equal(asked.length, 1);
    timers.tick(2000);
    await settle();
    assert.equal(asked.length, 2);
    assert.ok(meter.isCurrent.value);
    busy.value = true;
    assert.equal(meter.isCurrent.value, false);
    busy.value = false;
    online.value = false;
    assert.equal(meter.isCurrent.value, false);
    online.value = true;
    timers.tick(2000);
    await settle();
    assert.equal(asked.length, 3, 'back again it is measured anew');
    solo.value = ['key'];
    unsent = true;
    assert.equal(meter.isCurrent.value, false, 'of all lamps, where one is shown');
    timers.tick(2000);
    await settle();
    assert.equal(asked.length, 3, 'the server would measure all of them');
    unsent = false;
    timers.tick(2000);
    await settle();
    assert.equal(asked.length, 4);
    assert.equal(asked[3]!.view_id, 7);
    assert.ok(meter.isCurrent.value);
    timers.reset();
});

test('messages wait for who reads them', () => {
    const timers = new FakeTimers();
    const toasts = new Toasts();
    toasts.error(new Error('no'));
    toasts.hold();
    timers.tick(1e6);
    assert.equal(toasts.shown.value.length, 1);
    toasts.info('more');
    timers.tick(1e6);
    assert.equal(toasts.shown.value.length, 2);
    toasts.release();
    timers.tick(1e6);
    assert.equal(toasts.shown.value.length, 0);
    timers.reset();
});

test('a sky or a sun that is told no amount is as bright as the day makes it; told one, it is that', () => {
    const sky: SceneRecord = { type: 'light', id: 'sky', kind: 'sky' };
    assert.ok(intensityOf(sky).automatic);
    assert.equal(intensityOf(sky).field, 'illuminance_lx');
    assert.equal(intensityOf({ ...sky, luminance_cd_m2: 3000 }).automatic, false);
    assert.equal(intensityOf({ ...sky, luminance_cd_m2: null }).automatic, true);
    assert.equal(intensityOf({ type: 'light', id: 'bulb', kind: 'point' }).automatic, false);
});
