import assert from 'node:assert/strict';
import { test } from 'node:test';
import { signal } from '@preact/signals';
import { FakeTimers } from '../lib/fake_timers';
import type { JsonObject } from '../protocol/rpc';
import { Reader } from './readout';

test('a value of one map is not shown as one of another', async () => {
    const timers = new FakeTimers();
    const map = signal('luminance');
    const answers: ((r: JsonObject) => void)[] = [];
    const reader = new Reader({
        call: () => new Promise((done) => answers.push(done)),
        ...{ map, wanted: signal(true), online: signal(true), frame: signal(0), viewId: () => 1, size: () => [4, 4] as const },
    });
    const answer = async (r: JsonObject): Promise<void> => {
        answers.shift()!(r);
        for (let i = 0; i < 5; i++) await Promise.resolve();
        timers.tick(1000);
    };
    await answer({ unit: 'cd/m2', value: 20, error: 40 });
    assert.equal(reader.readout.value?.value, 20);
    reader.pointAt([0.1, 0.1]); // asks, and meanwhile the map becomes another
    map.value = 'illuminance';
    assert.equal(reader.readout.value, null);
    await answer({ unit: 'cd/m2', value: 21, error: 40 });
    assert.equal(reader.readout.value, null, 'it was asked for of the other map');
    reader.pointAt([0.2, 0.1]);
    await answer({ unit: 'lx', value: 500, error: 3 });
    assert.deepEqual({ ...(reader.readout.value as object) }, { middle: false, unit: 'lx', value: 500, error: 3 });
});
