import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { JsonObject } from '../protocol/rpc';
import type { CameraPose } from '../protocol/types';
import type { Edits } from './edits';
import { SceneMirror } from './scene';
import { apart, daylightInWords, gazeOf, judge, modellingInWords, pointAt, pointsInWords, readingOf, Sensors, stateOf, unknownInWords, verdict, worstInWords, worstPlaceInWords } from './sensors';

const TOLD: JsonObject = {
    id: 'desks', scene_rev: 7, settled: false, kind: 'grid', nu: 3, nv: 2, left_out: 1,
    em_lx: 512, em_stderr_lx: 9.1, emin_lx: 480, emin_stderr_lx: 14, uo: 0.94, uo_stderr: 0.03,
    targets: { em: { target: 500, passes: true, sure: false } },
};

function made(calls: [string, JsonObject][], answers: Record<string, JsonObject>) {
    const scene = new SceneMirror();
    const edits = { transaction: (ops: JsonObject[]) => void calls.push(['transaction', { ops }]) } as unknown as Edits;
    const call = (method: string, params: JsonObject): Promise<JsonObject> => {
        calls.push([method, params]);
        return Promise.resolve(answers[method] ?? {});
    };
    const pose = () => ({ position: [1, 2, 3], target: [1, 2, 1], up: [0, 1, 0], vfov_deg: 60 }) as CameraPose;
    const sensors = new Sensors({ scene, edits, pose, call, onError: (e) => assert.fail(e.message) });
    return { scene, sensors };
}

test('what is told of a sensor', () => {
    const r = readingOf(TOLD);
    assert.deepEqual(r.em, { value: 512, stderr: 9.1 });
    assert.equal(r.ugr, null);
    assert.equal(r.points, 6);
    assert.equal(r.leftOut, 1);
    assert.equal(verdict(r.targets.em!), 'meets 500, as far as is known');
    assert.equal(verdict({ target: 19, passes: false, sure: true }), 'misses 19');
});

test('an observer stands where the view is, and is glared by lamps and by day', async () => {
    const calls: [string, JsonObject][] = [];
    const { scene, sensors } = made(calls, {});
    scene.load([], 1);
    await sensors.addObserver();
    const [, { ops }] = calls.pop()!;
    assert.deepEqual(ops, [{ op: 'add', type: 'sensor', id: 'observer', kind: 'observer', position: [1, 2, 3], direction: [0, 0, -2], target_ugr: 19 }]);
    const r = readingOf({ kind: 'observer', dgp: 0.42, dgp_stderr: 0.002, dgp_band: 'disturbing', dgp_in_range: true, targets: { dgp: { target: 0.4, passes: false, sure: true } } });
    assert.deepEqual(r.dgp, { value: 0.42, stderr: 0.002 });
    assert.equal(daylightInWords(r), 'Glare by day: disturbing');
    assert.equal(verdict(r.targets.dgp!), 'misses 0.4');
    assert.match(daylightInWords({ dgpBand: 'imperceptible', dgpInRange: false }), /380 lx/);
});

test('modelling has a ratio, and its points come as planes and as cylinders', async () => {
    const points = [{ point: [0, 0.75, 0], lx: 500, stderr_lx: 4, ez_lx: 200, ez_stderr_lx: 3 }];
    const { scene, sensors } = made([], { 'sensor.read': { id: 'desks', kind: 'grid', quantity: 'modelling', points } });
    scene.load([{ op: 'add', type: 'sensor', id: 'desks', kind: 'grid', position: [0, 0.75, 0] }], 1);
    assert.equal(await sensors.csv(), 'sensor,quantity,x_m,y_m,z_m,value,stderr\ndesks,plane,0,0.75,0,500,4\ndesks,cylindrical,0,0.75,0,200,3\n');
    const r = readingOf({ ...TOLD, ez_lx: 205, modelling: 0.4, modelling_stderr: 0.01, modelling_in_range: true });
    assert.deepEqual(r.modelling, { value: 0.4, stderr: 0.01 });
    assert.equal(modellingInWords(r), 'Modelling is within 0.30 to 0.60, which EN 12464-1 recommends');
    assert.equal(readingOf(TOLD).modelling, null);
});

test('power is told with what is missing in it', () => {
    const told = { watts: 120, floor_m2: 20, w_per_m2: 6, w_per_m2_100_lx: 1.2, lamps: 12, lamps_without_watts: 2, without_watts: [{ what: 'quad', id: 'panel-a', n: 2 }] };
    const power = readingOf({ ...TOLD, power: told }).power!;
    assert.deepEqual([power.watts, power.floorM2, power.perM2, power.per100Lx], [120, 20, 6, 1.2]);
    assert.equal(unknownInWords(power), 'Without 2 of 12 lamps, whose power is not known: quad (panel-a and others)');
    assert.equal(unknownInWords({ ...power, unknown: 0 }), null);
    assert.equal(readingOf({ ...TOLD, power: { ...told, w_per_m2: null } }).power, null, 'no file says');
    assert.equal(readingOf({ ...TOLD, power: { ...told, lamps: 0 } }).power, null);
    assert.equal(readingOf(TOLD).power, null);
});

test('of several observers the worst are named, by lamps and by day', () => {
    const eye = (ugr: number | null, dgp: number) => readingOf({ kind: 'observer', ugr, ugr_stderr: 0.1, dgp, dgp_stderr: 0.01 });
    const readings = new Map([['a', eye(21.26, 0.3)], ['b', eye(null, 0.382)], ['desks', readingOf(TOLD)]]);
    const name = (id: string): string => id.toUpperCase();
    assert.equal(worstInWords(readings, ['a', 'b', 'desks'], name), 'Worst of 2 observers: UGR 21.3 (A), DGP 0.38 (B)');
    assert.equal(worstInWords(readings, ['a', 'desks'], name), null);
});

test('sensors are watched where there are some, and anew on a new connection', () => {
    const calls: [string, JsonObject][] = [];
    const { scene, sensors } = made(calls, {});
    sensors.begin();
    scene.load([], 1);
    assert.deepEqual(calls, []);
    scene.load([{ op: 'add', type: 'sensor', id: 'desks', kind: 'point', position: [0, 1, 0] }], 2);
    assert.deepEqual(calls.pop(), ['sensor.watch', { on: true, points: true }]);
    sensors.notified({ sensors: [TOLD] });
    assert.equal(sensors.readings.value.get('desks')?.rev, 7);
    sensors.closed();
    assert.equal(sensors.readings.value.size, 0);
    sensors.begin();
    assert.deepEqual(calls.pop(), ['sensor.watch', { on: true, points: true }]);
    sensors.pointsShown.value = false;
    assert.deepEqual(calls.pop(), ['sensor.watch', { on: true }]);
    scene.load([], 3);
    assert.deepEqual(calls.pop(), ['sensor.watch', { on: false }]);
});

test('points lie in the middles of cells, and are judged by what is wanted', () => {
    const record = { type: 'sensor', id: 'desks', kind: 'grid', position: [1, 0.75, 2], u: [4, 0, 0], v: [0, 0, 2], target_lx: 500, target_uo: 0.6 };
    const { nu, nv, values } = readingOf({ ...TOLD, nu: 2, nv: 2, lx: [520, 480, null, 250] });
    assert.deepEqual([0, 1, 2, 3].map((i) => pointAt(record, { nu, nv }, i)), [[0, 0.75, 1.5], [2, 0.75, 1.5], [0, 0.75, 2.5], [2, 0.75, 2.5]]);
    assert.deepEqual(values.map((v) => v && judge(v, record)), ['met', 'near', null, 'missed']);
    assert.equal(pointsInWords(record, { values }), '1 of 3 points reach 500 lx, 1 is below 300');
    assert.equal(judge(499, { ...record, target_uo: null }), 'missed', 'nothing may be below the mean');
    assert.equal(judge(1, { ...record, target_lx: null }), 'plain');
    assert.equal(pointsInWords({ ...record, target_lx: null }, { values }), null);
});

test('numbers of points are left out where one would cover another, whichever rows they are of', () => {
    const places = [{ x: 0, y: 100 }, { x: 20, y: 100 }, { x: 40, y: 95 }, null, { x: 5, y: 90 }, { x: 5, y: 60 }];
    assert.deepEqual([...apart(places, 34, 17)].sort(), [0, 2, 5]);
});

test('a work plane is placed by the server and asks for what office work needs', async () => {
    const calls: [string, JsonObject][] = [];
    const { sensors } = made(calls, { 'sensor.place': { kind: 'grid', position: [0, 0.75, 0], u: [4, 0, 0], v: [0, 0, 3] } });
    await sensors.addWorkPlane();
    assert.deepEqual(calls.pop(), ['transaction', { ops: [{
        op: 'add', type: 'sensor', id: 'work-plane', kind: 'grid', position: [0, 0.75, 0], u: [4, 0, 0], v: [0, 0, 3], target_lx: 500, target_uo: 0.6,
    }] }]);
});

const EYES: JsonObject = {
    id: 'glare', scene_rev: 7, settled: true, kind: 'grid', quantity: 'ugr', nu: 2, nv: 2, left_out: 1, directions: 8,
    ugr: 20.42, ugr_stderr: 0.1, worst_point: [1, 1.2, -0.5], worst_direction: [0, 0, -1], targets: { ugr: { target: 19, passes: false, sure: true } },
};

test('eyes are placed all over the floor, and say where one is glared most', async () => {
    const calls: [string, JsonObject][] = [];
    const placed = { kind: 'grid', position: [0, 1.2, 0], u: [4, 0, 0], v: [0, 0, 3] };
    const { scene, sensors } = made(calls, { 'sensor.place': { ...placed, floor_m2: 20 } });
    await sensors.addEyes();
    const op = { op: 'add', type: 'sensor', id: 'glare', ...placed, quantity: 'ugr', directions: 8, target_ugr: 19 };
    assert.deepEqual(calls, [['sensor.place', { height_m: 1.2, directions: 8 }], ['transaction', { ops: [op] }]]);
    const r = readingOf({ ...EYES, point_ugr: [20.4, 18, null, 19] });
    assert.equal(worstPlaceInWords(r), 'Worst at x 1, y 1.2, z -0.5 m, looking along 0, 0, -1; of 8 lines of sight at each place');
    assert.deepEqual(gazeOf(r.worst!), { position: [1, 1.2, -0.5], target: [1, 1.2, -1.5], up: [0, 1, 0], vfov_deg: 60 });
    const record = { ...op, type: 'sensor', id: 'glare' };
    assert.deepEqual(r.values.map((v) => v && judge(v, record)), ['missed', 'met', null, 'met']);
    assert.equal(pointsInWords(record, r), '2 of 3 places that are glared have at most UGR 19');
    assert.equal(judge(30, { ...record, target_ugr: null }), 'plain');
    assert.equal(worstPlaceInWords(readingOf({ kind: 'grid', quantity: 'ugr', ugr: null })), null);
    scene.load([record], 1);
    sensors.measure(scene.peek('glare')!, 'plane');
    assert.deepEqual(calls.pop(), ['transaction', { ops: [{ op: 'set', id: 'glare', path: '/target_ugr', value: null }, { op: 'set', id: 'glare', path: '/quantity', value: 'plane' }] }]);
    sensors.measure({ ...record, quantity: 'plane', target_lx: 500, target_ugr: null }, 'ugr');
    assert.deepEqual((calls.pop()![1].ops as JsonObject[]).map((o) => o.path), ['/target_lx', '/quantity']);
});

test('each eye is a line of a file', async () => {
    const points = [{ point: [0, 1.2, 0], ugr: 18.2, ugr_stderr: 0.1, direction: [0, 0, -1] }, { point: [1, 1.2, 0], left_out: 'inside' }];
    const { scene, sensors } = made([], { 'sensor.read': { ...EYES, points } });
    scene.load([{ op: 'add', type: 'sensor', id: 'glare', kind: 'grid', position: [0, 1.2, 0] }], 1);
    assert.equal(await sensors.csv(), 'sensor,quantity,x_m,y_m,z_m,value,stderr\nglare,ugr,0,1.2,0,18.2,0.1\n');
});

test('points that count become lines of a file', async () => {
    const points = [{ point: [0, 0.75, 0], lx: 512.4, stderr_lx: 4.9 }, { point: [1, 0.75, 0], left_out: 'inside' }];
    const { scene, sensors } = made([], { 'sensor.read': { id: 'desks', kind: 'grid', quantity: 'cylindrical', points } });
    scene.load([{ op: 'add', type: 'sensor', id: 'desks', kind: 'grid', position: [0, 1, 0] }], 1);
    assert.equal(await sensors.csv(), 'sensor,quantity,x_m,y_m,z_m,value,stderr\ndesks,cylindrical,0,0.75,0,512.4,4.9\n');
});

test('an observer has a line with its UGR, and none while nothing glares', async () => {
    const observer: JsonObject = { op: 'add', type: 'sensor', id: 'eye', kind: 'observer', position: [0, 1.2, 0] };
    const glared = made([], { 'sensor.read': { id: 'eye', kind: 'observer', ugr: 16.4, ugr_stderr: 0.2 } });
    glared.scene.load([observer], 1);
    assert.equal(await glared.sensors.csv(), 'sensor,quantity,x_m,y_m,z_m,value,stderr\neye,ugr,0,1.2,0,16.4,0.2\n');
    const dark = made([], { 'sensor.read': { id: 'eye', kind: 'observer', ugr: null } });
    dark.scene.load([observer], 1);
    assert.equal(await dark.sensors.csv(), 'sensor,quantity,x_m,y_m,z_m,value,stderr\n');
});

test('what is known of a sensor in words', () => {
    const reading = (more: JsonObject) => readingOf({ ...TOLD, ...more });
    assert.equal(stateOf(reading({}), true), '5 points, 1 left out …');
    assert.equal(stateOf(reading({ settled: true, left_out: 0 }), true), '6 points');
    assert.equal(stateOf(reading({ nu: 1, nv: 1, settled: true }), true), 'inside something, or right below it');
    assert.equal(stateOf(reading({ nu: 1, nv: 1, left_out: 0 }), false), 'before the last change');
    assert.equal(stateOf(undefined, false), 'not measured yet');
});
