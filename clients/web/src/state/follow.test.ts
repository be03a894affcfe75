import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { JsonObject } from '../protocol/rpc';
import { Follower } from './follow';
import { SceneMirror } from './scene';

const lamp = (flux_lm: number): JsonObject => ({ op: 'add', type: 'light', id: 'key', kind: 'point', flux_lm });
const set = (scene_rev: number, value: number): JsonObject => ({ scene_rev, ops: [{ op: 'set', id: 'key', path: '/flux_lm', value }] });

function rig(): { scene: SceneMirror; follower: Follower; asked: ((rev: number) => void)[]; flux(): unknown } {
    const scene = new SceneMirror();
    const asked: ((rev: number) => void)[] = [];
    const get = (): Promise<JsonObject> => new Promise((answer) => asked.push((rev) => answer({ ops: [lamp(rev)], scene_rev: rev })));
    return { scene, follower: new Follower(scene, get), asked, flux: () => scene.peek('key')?.flux_lm };
}
const settle = (): Promise<void> => new Promise((r) => setImmediate(r));

test('changes are followed one by one, without asking', async () => {
    const { scene, follower, asked, flux } = rig();
    const begun = follower.begin();
    asked[0]!(5);
    await begun;
    for (let rev = 6; rev < 20; rev++) await follower.follow(set(rev, 10 * rev));
    assert.deepEqual([scene.rev.value, flux(), asked.length], [19, 190, 1]);
});

test('a gap asks for the scene once, however many changes come while it is on its way', async () => {
    const { scene, follower, asked, flux } = rig();
    const begun = follower.begin();
    asked[0]!(5);
    await begun;
    const all = [8, 9, 10, 11].map((rev) => follower.follow(set(rev, 1)));
    await settle();
    assert.equal(asked.length, 2);
    asked[1]!(11); // answers are in order with what is told
    await Promise.all(all);
    assert.deepEqual([scene.rev.value, flux(), asked.length], [11, 11, 2]);
    await follower.follow(set(12, 120));
    assert.deepEqual([flux(), asked.length], [120, 2]);
});

test('a scene that is older than what was told is asked for again', async () => {
    const { scene, follower, asked } = rig();
    const begun = follower.begin();
    asked[0]!(5);
    await begun;
    const first = follower.follow(set(8, 1));
    const second = follower.follow(set(9, 1));
    asked[1]!(8);
    await first;
    await settle();
    assert.equal(asked.length, 3);
    asked[2]!(9);
    await second;
    assert.equal(scene.rev.value, 9);
});

test('a new connection asks anew, although the revision is lower', async () => {
    const { scene, follower, asked } = rig();
    const begun = follower.begin();
    asked[0]!(5);
    await begun;
    const again = follower.begin();
    asked[1]!(1);
    await again;
    assert.equal(scene.rev.value, 1);
});
