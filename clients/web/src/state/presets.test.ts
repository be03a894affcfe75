import assert from 'node:assert/strict';
import { test } from 'node:test';
import { inOrder, moved, nameOf, stemOf } from './presets';

const preset = (id: string, order?: number, name?: string) => ({ type: 'preset', id, ...(order === undefined ? {} : { order }), ...(name === undefined ? {} : { name }) });

test('presets stand in their order, then by id', () => {
    assert.deepEqual(inOrder([preset('c', 2), preset('b', 1), preset('a', 2), preset('d')]).map((p) => p.id), ['d', 'b', 'a', 'c']);
    assert.equal(nameOf(preset('a', 1, 'Evening')), 'Evening');
    assert.equal(nameOf(preset('a')), 'a');
});

test('one moves by a place, and not beyond the ends', () => {
    const all = [preset('a', 1), preset('b', 2), preset('c', 3)];
    assert.deepEqual(moved(all, 'b', -1).map((op) => [op.id, op.op === 'set' && op.value]), [['b', 1], ['a', 2]]);
    assert.deepEqual(moved(all, 'a', -1), []);
    assert.deepEqual(moved(all, 'c', 1), []);
    assert.equal(moved([preset('a'), preset('b')], 'a', 1).length, 2, 'where none has an order yet, all get one');
});

test('a name makes an id of the characters that ids have', () => {
    assert.equal(stemOf('Evening, late'), 'preset-evening-late');
    assert.equal(stemOf('夜'), 'preset-look');
});
