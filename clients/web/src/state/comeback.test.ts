import assert from 'node:assert/strict';
import { beforeEach, test } from 'node:test';
import { Comeback } from './comeback';

let told: string[];
let comeback: Comeback;

beforeEach(() => {
    told = [];
    comeback = new Comeback((text) => told.push(text));
    assert.equal(comeback.online({ resumed: false, missed: null, scene_rev: 4 }, true), false);
});

const changed = (user: string, ...ids: string[]): void => comeback.changed({ user, ops: ids.map((id) => ({ op: 'set', id })) }, user === 'me.1-1');

test('a picture is old from the moment the connection breaks until one of the newest revision is there', () => {
    assert.equal(comeback.isStale.value, false, 'the first one');
    comeback.connectionLost();
    assert.ok(comeback.isStale.value);
    comeback.online({ resumed: true, missed: 3, scene_rev: 9 }, false);
    assert.ok(comeback.isStale.value);
    comeback.drawn(8);
    assert.ok(comeback.isStale.value, 'one that was on its way');
    comeback.drawn(9);
    assert.equal(comeback.isStale.value, false);
});

test('it is told who changed what meanwhile, in one sentence, when all of it is known', () => {
    comeback.connectionLost();
    assert.equal(comeback.online({ resumed: true, missed: 4, scene_rev: 9 }, false), true);
    changed('ann.3-1', 'key');
    changed('me.1-1', 'mine');
    changed('bob.2-7.2', 'key', 'sun');
    assert.deepEqual(told, []);
    changed('ann.3-1', 'a', 'b', 'c');
    assert.deepEqual(told, ['While you were away ann, bob changed key, a, b and 2 more']);
    changed('ann.3-1', 'later');
    assert.equal(told.length, 1);
});

test('what oneself changed is no news', () => {
    comeback.connectionLost();
    comeback.online({ resumed: true, missed: 2, scene_rev: 9 }, false);
    changed('me.1-1', 'mine');
    changed('me.1-1', 'mine');
    assert.deepEqual(told, []);
});

test('where the server does not know, the scene has to be got anew', () => {
    comeback.connectionLost();
    assert.equal(comeback.online({ resumed: true, missed: null, scene_rev: 9 }, false), false);
    assert.equal(told.length, 1);
    assert.equal(comeback.online({ resumed: false, missed: null, scene_rev: 9 }, false), false);
    assert.equal(told.length, 1, 'another server');
});
