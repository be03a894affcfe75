import assert from 'node:assert/strict';
import { test } from 'node:test';
import { dot, length, type Vec3 } from '../lib/vec';
import type { JsonObject } from '../protocol/rpc';
import type { Op, SceneRecord } from '../protocol/types';
import { aimOps, alignOps, anglesOfAll, distributeOps, tileOps, yawOps, nearestFree } from './arrange';
import { common, copyOps, inWords } from './many';
import { aimOf } from './lamp_make';
import { anchorOf } from './placement';
import { withField } from './scene';

const lamp = (id: string, position: Vec3, more: JsonObject = {}): SceneRecord => ({ type: 'light', kind: 'ies', asset: 'a.ies', id, position: [...position], ...more });
const box = (id: string, translate: Vec3, more: JsonObject = {}): SceneRecord => ({ type: 'object', id, mesh: 'm', transform: { translate: [...translate], ...more } });

/** The records as the ops make them. */
function after(records: readonly SceneRecord[], ops: readonly Op[]): SceneRecord[] {
    return records.map((r) => ops.filter((op) => op.id === r.id).reduce((now, op) => (op.op === 'set' ? withField(now, op.path, op.value)! : now), r));
}
const places = (records: readonly SceneRecord[]): Vec3[] => records.map(anchorOf);

test('what all have is told, and what they differ in is not', () => {
    assert.equal(common([3, 3 + 1e-9, 3]), 3);
    assert.equal(common([100001, 100002]), 100001, 'rounded to six digits');
    assert.equal(common([3, 3.001]), null);
    assert.equal(common([0, 0]), 0);
    assert.equal(common([0, 1e-9]), null);
    assert.equal(common([]), null);
    assert.equal(common([1, null]), null);
});

test('lamps and objects go to one coordinate, and to equal gaps between the outermost', () => {
    const all = [lamp('a', [0, 2.8, 0]), box('b', [5, 0.4, 2]), lamp('c', [1, 2.8, 7])];
    assert.deepEqual(places(after(all, alignOps(all, 2, 1.5))), [[0, 2.8, 1.5], [5, 0.4, 1.5], [1, 2.8, 1.5]]);
    assert.deepEqual(places(after(all, distributeOps(all, 0))), [[0, 2.8, 0], [5, 0.4, 2], [2.5, 2.8, 7]]);
    assert.deepEqual(distributeOps(all.slice(0, 2), 0), [], 'two have one gap');
    const far: SceneRecord = { type: 'light', kind: 'directional', id: 'sun' };
    assert.deepEqual(alignOps([far], 0, 1), [], 'what is far away has no place');
});

test('lamps go into tiles of their own, at their height, however the floor lies', () => {
    // 3.1 x 2 m in tiles of 0.6 m: five columns, 0.05 m cut at both ends, and three rows, 0.1 m.
    for (const [u, v] of [[[3.1, 0, 0], [0, 0, 2]], [[0, 0, -3.1], [2, 0, 0]]] as [Vec3, Vec3][]) {
        const floor = { position: [1, 0, -2], u: [...u], v: [...v] };
        const all = [lamp('a', [1.02, 2.7, -2]), lamp('b', [1.01, 2.6, -2.01]), lamp('c', [90, 2.8, 90])];
        const put = places(after(all, tileOps(all, floor, 0.6)!));
        assert.deepEqual(put.map((p) => p[1]), [2.7, 2.6, 2.8]);
        const cells = put.map(([x, , z]): [number, number] => {
            const off: Vec3 = [x - 1, 0, z + 2];
            const along = (e: Vec3): number => dot(off, e) / length(e) / 0.6;
            return [along(u), along(v)];
        });
        // Odd numbers of both: one is in the middle.
        for (const [i, j] of cells) assert.ok(Math.abs(i - Math.round(i)) < 2e-3 && Math.abs(j - Math.round(j)) < 2e-3 && Math.abs(i) <= 2.01 && Math.abs(j) <= 1.01, `${i} ${j}`);
        assert.equal(new Set(cells.map(([i, j]) => `${Math.round(i)} ${Math.round(j)}`)).size, 3, 'each has its own');
        assert.ok(cells.some(([i, j]) => Math.hypot(i, j) < 1e-2));
    }
    const many = Array.from({ length: 5 }, (_, i) => lamp(`l${i}`, [0, 2, 0]));
    assert.equal(tileOps(many, { position: [0, 0, 0], u: [1, 0, 0], v: [0, 0, 1] }, 0.5), null, 'four tiles, five lamps');
});

test('one angle is set for all, and each keeps its other', () => {
    const all = [lamp('a', [0, 0, 0], { direction: [1, 0, 0] }), lamp('b', [0, 0, 0], { direction: [0, 0, 1] })];
    assert.equal(anglesOfAll(all).turn, null);
    assert.equal(Math.round(anglesOfAll(all).tilt!), 90);
    const tilted = after(all, aimOps(all, { tilt: 30 }));
    assert.ok(Math.abs(anglesOfAll(tilted).tilt! - 30) < 1e-2);
    assert.ok(aimOf(tilted[0]!)[0] > 0.49 && aimOf(tilted[1]!)[2] > 0.49);
    const boxes = [box('x', [1, 0, 0], { rotate_deg: [10, 20, 30] }), { type: 'object', id: 'y', mesh: 'm' }];
    const turned = after(boxes, yawOps(boxes, 45));
    assert.deepEqual(turned.map((r) => (r.transform as JsonObject).rotate_deg), [[10, 45, 30], [0, 45, 0]]);
    assert.deepEqual(places(turned), [[1, 0, 0], [0, 0, 0]]);
});

test('copies have names of their own, and stand where they are to', () => {
    const all = [lamp('a', [1, 2, 3]), lamp('a-2', [2, 2, 3]), box('b', [0, 0, 0]), { type: 'import', id: 'm', asset: 'm.glb' }, lamp('own', [0, 0, 0], { asset: null })];
    const { ops, ids } = copyOps(all, [0, 0, 1], (id) => all.some((r) => r.id === id));
    assert.deepEqual(ids, ['a-3', 'a-4', 'b-2']);
    const made = ops.filter((op) => op.op === 'add').map((op) => op as unknown as SceneRecord);
    assert.deepEqual(places(after(made, ops)), [[1, 2, 4], [2, 2, 4], [0, 0, 1]]);
    assert.equal(inWords(all), '3 lamps, 2 objects');
});

test('the nearest tile that is free is found beside where one is, however many tiles there are', () => {
    const [columns, rows] = [7, 5];
    const taken = new Set<number>();
    for (const at of [[3, 2], [3.2, 2.4], [3, 2], [-4, 9], [3.49, 2.51], [100, 2], [100, 2], [100, 2.4], [3, -80], [0, 0], [6.4, 4.4], [3, 2], [3, 2], [-9, -9]] as const) {
        const [i, j] = nearestFree(at, columns, rows, taken);
        const free = Array.from({ length: columns * rows }, (_, k) => k).filter((k) => !taken.has(k));
        const away = (k: number): number => Math.hypot((k % columns) - at[0], Math.floor(k / columns) - at[1]);
        assert.ok(free.includes(i + j * columns), `${i}, ${j} is taken`);
        assert.equal(away(i + j * columns), Math.min(...free.map(away)), `${at}`);
        taken.add(i + j * columns);
    }
    // A floor of 100 m in tiles of 5 cm: 100 lamps in one place, and as many beyond its corner.
    let looks = 0;
    const counted = new (class extends Set<number> {
        override has(k: number): boolean {
            looks++;
            return super.has(k);
        }
    })();
    for (const at of [[1000, 1000], [9000, 9000]] as const)
        for (let n = 0; n < 100; n++) {
            const [i, j] = nearestFree(at, 2000, 2000, counted);
            counted.add(i + j * 2000);
        }
    assert.ok(counted.size === 200 && looks < 2000 * 2000, `${looks} tiles were looked at`);
});
