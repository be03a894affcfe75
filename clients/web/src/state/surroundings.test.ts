import assert from 'node:assert/strict';
import { test } from 'node:test';
import { signal } from '@preact/signals';
import { FakeTimers } from '../lib/fake_timers';
import type { JsonObject } from '../protocol/rpc';
import type { CameraPose } from '../protocol/types';
import { Surroundings } from './surroundings';

const at = (x: number): CameraPose => ({ position: [x, 1, 0], target: [0, 1, 5], up: [0, 1, 0], vfov_deg: 45 });
const settle = async (): Promise<void> => {
    for (let i = 0; i < 5; i++) await Promise.resolve();
};

test('what is around the eye is asked where it comes to rest, and an eye at the border is not in and out by turns', async () => {
    const timers = new FakeTimers();
    const pose = signal(at(0));
    const answers: JsonObject[] = [];
    let asked = 0;
    const around = new Surroundings({
        ...{ pose, viewId: () => 1 },
        call: () => (asked++, answers.length > 0 ? Promise.resolve(answers.shift()!) : Promise.reject(new Error('not connected'))),
    });
    const rests = async (x: number, answer?: JsonObject): Promise<void> => {
        if (answer) answers.push(answer);
        pose.value = at(x);
        timers.tick(1000);
        await settle();
    };
    await rests(0, { enclosed: 0.65, reach: 9 });
    assert.equal(around.room.value, null, 'not yet in');
    await rests(1, { enclosed: 0.95, reach: 3 });
    assert.equal(around.room.value, 3);
    await rests(2, { enclosed: 0.65, reach: 2 });
    assert.equal(around.room.value, 2, 'not yet out');
    await rests(3, { enclosed: 0.2, reach: 2 });
    assert.equal(around.room.value, null);
    const before = asked;
    pose.value = { ...at(3), target: [0, 0, 0] }; // the head alone
    timers.tick(1000);
    await settle();
    assert.equal(asked, before);
    for (let x = 4; x < 9; x++) pose.value = at(x); // on its way: nothing is asked
    await rests(9, { enclosed: 1, reach: 1 });
    assert.equal(asked, before + 1);
    await rests(10); // refused: asked again from there
    await rests(10.5, { enclosed: 0, reach: 0 });
    assert.equal(around.room.value, null);
});

test('where the scene becomes another, or was not told, it is asked again', async () => {
    const timers = new FakeTimers();
    const pose = signal(at(0));
    let enclosed = 0;
    const around = new Surroundings({ ...{ pose, viewId: () => 1 }, call: () => Promise.resolve({ enclosed, reach: 2 }) });
    timers.tick(1000);
    await settle();
    assert.equal(around.room.value, null);
    enclosed = 1; // walls were built
    for (let i = 0; i < 5; i++) around.again();
    timers.tick(1000);
    await settle();
    assert.equal(around.room.value, 2);
});
