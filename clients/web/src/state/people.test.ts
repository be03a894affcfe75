import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { signal } from '@preact/signals';
import { linearFromHex, luminance } from '../lib/colour';
import { FakeTimers } from '../lib/fake_timers';
import type { JsonObject } from '../protocol/rpc';
import type { CameraPose } from '../protocol/types';
import { COLOURS, People, peopleIn } from './people';

const POSE: CameraPose = { position: [0, 1, 3], target: [0, 1, 0], up: [0, 1, 0], vfov_deg: 45 };
const here = (session: string, more: JsonObject = {}): JsonObject => ({ session, person: '', role: 'edit', camera: null, point: null, ...more });

test('names in their colours have a contrast of 4.5 on what is behind them', () => {
    const css = readFileSync('src/style/tokens.css', 'utf8');
    const greys = ['bg', 'panel', 'raised'].map((name) => new RegExp(`--${name}: (#[0-9a-f]{6})`).exec(css)![1]!);
    for (const colour of COLOURS)
        for (const grey of ['#101010', ...greys]) {
            const c = (luminance(linearFromHex(colour)) + 0.05) / (luminance(linearFromHex(grey)) + 0.05);
            assert.ok(c >= 4.5, `${colour} on ${grey}: ${c.toFixed(2)}`);
        }
    assert.equal(new Set(COLOURS).size, COLOURS.length);
});

test('everybody has a name of her own, whatever the server says', () => {
    const names = (...list: JsonObject[]): string[] => peopleIn(list).map((p) => p.name);
    assert.deepEqual(names(here('ann.0-1', { person: 'ann' }), here('lumend-web.1-1'), here('bot.2-4.7')), ['ann', 'Guest', 'bot']);
    assert.deepEqual(names(here('lumend-web.0-1'), here('ann.1-1'), here('lumend-web.2-1')), ['Guest 1', 'ann', 'Guest 2']);
    assert.deepEqual(peopleIn('junk'), []);
    const odd = peopleIn([{ session: 5, camera: 'x', point: [1] }, 7])[0]!;
    assert.deepEqual([odd.name, odd.camera, odd.point], ['Guest', null, [0, 0, 0]]);
});

test('who is alone moves unseen; once another comes she is told where this page stands, and who came and left is said', async (t) => {
    const timers = new FakeTimers();
    t.after(() => timers.reset());
    const sent: JsonObject[] = [];
    const said: string[] = [];
    const picked: unknown[] = [];
    const pose = signal(POSE);
    const people = new People({
        ...{ online: signal(true), pose, announce: (text) => said.push(text) },
        call: (method, params) => (sent.push({ method, ...params }), Promise.resolve({})),
        pick: (x, y) => (picked.push([x, y]), Promise.resolve({ id: 'floor', point: [1, 0, 2], normal: [0, 1, 0], distance: 3 })),
    });
    await people.begin('me.0-1');
    people.notified({ people: [here('me.0-1')] });
    people.pointAt([0.5, 0.5]);
    pose.value = { ...POSE, vfov_deg: 50 };
    timers.tick(1000);
    assert.deepEqual([sent.length, picked.length, people.others.value], [1, 0, []]);
    people.notified({ people: [here('me.0-1'), here('ann.1-1')] });
    timers.tick(100);
    assert.deepEqual(sent.at(-1)?.camera, { ...POSE, vfov_deg: 50 });
    for (let i = 0; i < 20; i++) pose.value = { ...POSE, vfov_deg: 51 + i };
    people.pointAt([0.2, 0.3]);
    people.pointAt([0.4, 0.5]);
    await Promise.resolve();
    await Promise.resolve();
    timers.tick(100);
    assert.deepEqual([sent.length, picked], [3, [[0.2, 0.3]]], 'a hand that moves is told ten times a second at most');
    assert.deepEqual([sent[2]?.point, (sent[2]?.camera as JsonObject).vfov_deg], [[1, 0, 2], 70]);
    people.notified({ people: [here('me.0-1')] });
    assert.deepEqual(said, ['ann is here', 'ann left']);
});
