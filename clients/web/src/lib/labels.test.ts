import assert from 'node:assert/strict';
import { test } from 'node:test';
import { withRoom } from './labels';

const at = (x: number, y: number, text = 'lamp-1'): { x: number; y: number; text: string } => ({ x, y, text });

test('of names that lie over each other the first is kept, and what only it was in the way of', () => {
    assert.deepEqual([...withRoom([at(0, 0), at(30, 5), at(60, 0)])], [0, 2]);
    assert.deepEqual([...withRoom([at(30, 5), at(0, 0), at(60, 0)])], [0]);
});

test('lines above each other, long names, and what is not in the picture', () => {
    assert.deepEqual([...withRoom([at(0, 0), at(0, 17), at(0, -17)])], [0, 1, 2]);
    assert.deepEqual([...withRoom([at(0, 0, 'x'.repeat(40)), at(140, 0), at(180, 0)])], [0, 2]);
    assert.deepEqual([...withRoom([null, at(0, 0), null, at(0, 0)])], [1]);
    assert.equal(withRoom([]).size, 0);
});

test('no two that are kept touch, and each that gave way touches one that is kept', () => {
    let seed = 1;
    const random = (below: number): number => ((seed = (seed * 16807) % 2147483647) / 2147483647) * below;
    const labels = Array.from({ length: 200 }, () => at(random(600), random(300), 'abcdefghijklmnop'.slice(0, 1 + Math.floor(random(16)))));
    const kept = withRoom(labels);
    const touches = (a: number, b: number): boolean => withRoom([labels[a]!, labels[b]!]).size === 1;
    for (const [i] of labels.entries()) {
        const others = [...kept].filter((k) => k !== i);
        assert.equal(others.some((k) => touches(i, k)), !kept.has(i), `label ${i}`);
    }
});
