import assert from 'node:assert/strict';
import { test } from 'node:test';
import { signal } from '@preact/signals';
import { length, sub, type Vec3 } from '../lib/vec';
import type { JsonObject } from '../protocol/rpc';
import { stringOr, vec3Or, type Op, type SceneRecord } from '../protocol/types';
import { Library } from './library';
import { arrayOps, axesOf, factsOf, luminaireOp, polarPath, spreadOver } from './luminaires';

const TOLD: JsonObject = {
    ...{ name: 'Maker Spot', flux_lm: 877.7, watts: 9.5, beam_deg: [23, 24], size: [0.1, 0.1, 0.04], warnings: ['TILT is left out'] },
    polar_cd: { gamma_deg: [0, 90, 180], c0: [100, 50, 0], c90: [100, 20, 0], c180: [100, 50, 0], c270: [100, 10, 0] },
};
const hung: SceneRecord = { type: 'light', id: 'spot', kind: 'ies', asset: 'spot.ies', position: [1, 2.7, 1], direction: [0, -1, 0], photometry: { flux_lm: 1 } };
const nobody = (): boolean => false;
const near = (a: Vec3, b: Vec3): void => assert.ok(length(sub(a, b)) < 1e-6, `${a} and ${b}`);

test('a web is drawn with its aim downwards, and one plane to each side', () => {
    const facts = factsOf(TOLD);
    assert.deepEqual([facts.fluxLm, facts.watts, facts.size[2]], [877.7, 9.5, 0.04]);
    assert.equal(polarPath(facts.polar!, 'c0').replace(/-0\.000/g, '0.000'), 'M0.000 1.000L0.500 0.000L0.000 0.000L0.000 0.000L-0.500 0.000L0.000 1.000Z');
    assert.match(polarPath(facts.polar!, 'c90'), /L0\.200 .*L-0\.100 /);
});

test('a luminaire hangs under what it was dropped on, off it by half its height, and shines away from it', () => {
    for (const normal of [[0, -1, 0], [1, 0, 0], [0, 1, 0]] as Vec3[]) {
        const op = luminaireOp('l', 'a.ies', { point: [1, 2, 3], normal }, 0.1) as unknown as SceneRecord;
        near(vec3Or(op.direction, [9, 9, 9]), normal);
        assert.ok(Math.abs(length(sub(vec3Or(op.position, [0, 0, 0]), [1, 2, 3])) - 0.06) < 1e-9);
    }
    near(vec3Or((luminaireOp('l', 'a.ies', { point: [0, 1, 0], normal: null }, 1) as unknown as SceneRecord).position, [9, 9, 9]), [0, 1, 0]);
});

const places = (ops: Op[]): Vec3[] => ops.filter((op) => op.op === 'add').map((op) => vec3Or((op as unknown as SceneRecord).position, [9, 9, 9]));

test('rows of a lamp are one step, of one group, each with a name of its own', () => {
    const { across, along } = axesOf(hung);
    const ops = arrayOps(hung, { columns: 3, rows: 2, across, along, from: null }, (id) => id === 'spot' || id === 'spot-3');
    assert.deepEqual(ops[0], { op: 'set', id: 'spot', path: '', value: { group: 'spot' } });
    assert.deepEqual(ops.slice(1).map((op) => op.id), ['spot-2', 'spot-4', 'spot-5', 'spot-6', 'spot-7']);
    assert.deepEqual(places(ops), [[2, 2.7, 1], [3, 2.7, 1], [1, 2.7, 2], [2, 2.7, 2], [3, 2.7, 2]]);
    assert.ok(ops.slice(1).every((op) => 'group' in op && op.group === 'spot' && !('photometry' in op)));
    const wall = axesOf({ ...hung, direction: [0, 0, 1] });
    near(wall.along, [0, 1, 0]);
    near(wall.across, [1, 0, 0]);
});

test('spread over a floor they stand in the middles of equal cells, at the height of the lamp', () => {
    const floor = { kind: 'grid', position: [1, 0.75, 0], u: [8, 0, 0], v: [0, 0, 6] };
    const ops = arrayOps(hung, spreadOver(hung, floor, 4, 3), nobody);
    assert.deepEqual(ops[1], { op: 'set', id: 'spot', path: '/position', value: [-2, 2.7, -2] });
    assert.equal(places(ops).length, 11);
    assert.deepEqual(places(ops)[0], [0, 2.7, -2]);
    assert.deepEqual(places(ops).at(-1), [4, 2.7, 2]);
});

const settle = async (): Promise<void> => {
    for (let i = 0; i < 8; i++) await Promise.resolve();
};

/** Its server has those files, and refuses those whose names begin with "no". */
function libraryOf(files: string[]): Library {
    return new Library({
        online: signal(true),
        call: (method, params) => {
            if (method === 'asset.list') return Promise.resolve({ assets: files.map((asset) => ({ asset })), whole: true });
            return /^no/i.test(stringOr(params.asset, '')) ? Promise.reject(new Error('line 1: no')) : Promise.resolve(TOLD);
        },
        pick: () => Promise.resolve(null),
        place: () => Promise.resolve(true),
    });
}

test('files are listed by name, and those that were refused after all others', async () => {
    const library = libraryOf(['NO-1.ies', 'no-10.ies', 'no-2.ies', 'spot-10.ies', 'spot-2.ies']);
    await library.load();
    assert.deepEqual(library.found.value, ['NO-1.ies', 'no-2.ies', 'no-10.ies', 'spot-2.ies', 'spot-10.ies'], 'nothing is known of them yet');
    library.want(library.found.value);
    for (let i = 0; i < 5; i++) await settle();
    assert.deepEqual(library.found.value, ['spot-2.ies', 'spot-10.ies', 'NO-1.ies', 'no-2.ies', 'no-10.ies']);
    library.search.value = '2';
    assert.deepEqual(library.found.value, ['spot-2.ies', 'no-2.ies'], 'of those that are found, too');
});

test('one that is refused while it is chosen stays where it is until another is chosen', async () => {
    const library = libraryOf(['a.ies', 'no.ies', 'z.ies']);
    await library.load();
    library.chosen.value = 'no.ies';
    library.want(library.found.value);
    for (let i = 0; i < 5; i++) await settle();
    assert.deepEqual(library.found.value, ['a.ies', 'no.ies', 'z.ies']);
    library.chosen.value = 'z.ies';
    assert.deepEqual(library.found.value, ['a.ies', 'z.ies', 'no.ies']);
    library.chosen.value = 'no.ies';
    assert.deepEqual(library.found.value, ['a.ies', 'z.ies', 'no.ies'], 'to choose it does not move it');
});

test('files are read two at a time, those in sight first, and found by what they say', async () => {
    const asked: string[] = [];
    const answers: (() => void)[] = [];
    const library = new Library({
        online: signal(true),
        call: (method, params) => {
            if (method === 'asset.list') return Promise.resolve({ assets: ['a.ies', 'b.ies', 'c.ies', 'd.ies'].map((asset) => ({ asset })), whole: true });
            const asset = stringOr(params.asset, '');
            asked.push(asset);
            return new Promise((done, fail) => answers.push(() => (asset === 'd.ies' ? fail(new Error('line 3: no')) : done({ ...TOLD, name: `lamp ${asset[0]}` }))));
        },
        pick: () => Promise.resolve(null),
        place: () => Promise.resolve(true),
    });
    await library.load();
    library.want(['c.ies', 'd.ies', 'a.ies']);
    assert.deepEqual(asked, ['c.ies', 'd.ies']);
    answers.shift()!();
    await settle();
    assert.deepEqual(asked, ['c.ies', 'd.ies', 'a.ies']);
    library.want(['c.ies', 'd.ies']); // known, or asked for
    answers.splice(0).forEach((a) => a());
    await settle();
    assert.equal(library.facts.value.get('d.ies'), 'line 3: no');
    assert.equal(asked.length, 3);
    library.search.value = 'LAMP c';
    assert.deepEqual(library.found.value, ['c.ies']);
    library.want(library.found.value);
    assert.deepEqual(asked.slice(3), ['b.ies'], 'a search wants all');
});

test('a luminaire is dropped where the pointer is in the picture, and nowhere else', async () => {
    const placed: unknown[] = [];
    const library = new Library({
        online: signal(true),
        call: () => Promise.reject(new Error('not asked')),
        pick: () => Promise.resolve({ id: 'ceiling', point: [0, 2.8, 0], normal: [0, -1, 0], distance: 3 }),
        place: (...of) => Promise.resolve(placed.push(of) > 0),
    });
    library.dragTo('a.ies', 5, 5, null);
    library.drop();
    library.dragTo('a.ies', 5, 5, [0.5, 0.25]);
    for (let i = 0; i < 4; i++) await Promise.resolve();
    assert.equal(library.drag.value?.on?.id, 'ceiling');
    library.cancelDrag();
    library.drop();
    assert.deepEqual(placed, []);
    library.dragTo('a.ies', 5, 5, [0.5, 0.25]);
    library.drop();
    assert.deepEqual(placed, [['a.ies', 0, [0.5, 0.25]]]);
    assert.equal(library.drag.value, null);
});
