import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { signal } from '@preact/signals';
import { linearFromHex, luminance } from '../lib/colour';
import { FakeTimers } from '../lib/fake_timers';
import type { JsonObject } from '../protocol/rpc';
import type { CameraPose } from '../protocol/types';
import { COLOURS, People, peopleIn, type Known } from './people';
import { pickAt } from './pick';

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
    assert.deepEqual(names(here('lumend-web.0-1'), here('ann.1-1'), here('lumend-web.2-1')), ['Guest', 'ann', 'Guest 2']);
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

test('a pointer past the edge points at nothing, a refusal stops none, and one that left is not told to who comes later', async (t) => {
    const timers = new FakeTimers();
    t.after(() => timers.reset());
    const told: JsonObject[] = [];
    const asked: JsonObject[] = [];
    let refuses = false;
    const call = (_: string, params: JsonObject): Promise<JsonObject> => {
        asked.push(params);
        return refuses ? Promise.reject(new Error('too many requests')) : Promise.resolve({ id: 'floor', point: [1, 0, 2] });
    };
    for (const [x, y] of [[-0.01, 0.5], [1, 0.5], [0.5, 1.2], [0.5, -1], [NaN, 0]] as const) assert.equal(await pickAt(call, { viewId: 3, size: [200, 100] }, x, y), null);
    assert.equal(await pickAt(call, { viewId: null, size: [200, 100] }, 0.5, 0.5), null);
    assert.equal(asked.length, 0);
    const people = new People({
        ...{ online: signal(true), pose: signal(POSE), announce: () => {} },
        call: (_, params) => (told.push(params), Promise.resolve({})),
        pick: (x, y) => pickAt(call, { viewId: 3, size: [200, 100] }, x, y),
    });
    const rest = async (): Promise<void> => {
        for (let i = 0; i < 5; i++) {
            for (let k = 0; k < 10; k++) await Promise.resolve();
            timers.tick(250);
        }
    };
    await people.begin('me.0-1');
    const two = { people: [here('me.0-1'), here('ann.1-1')] };
    people.notified(two);
    people.pointAt([0.5, 0.5]);
    await rest();
    assert.deepEqual([asked.at(-1), told.at(-1)?.point], [{ view_id: 3, x: 100, y: 50 }, [1, 0, 2]]);
    refuses = true;
    people.pointAt([0.6, 0.5]);
    await rest();
    assert.equal(told.at(-1)?.point, null);
    refuses = false;
    people.pointAt([0.7, 0.5]);
    await rest();
    assert.deepEqual(told.at(-1)?.point, [1, 0, 2]);
    people.notified({ people: [here('me.0-1')] });
    people.pointAt(null);
    people.notified(two);
    await rest();
    assert.equal(told.at(-1)?.point, null);
});

test('who is here keeps her name and her colour when others come and leave', () => {
    const known = new Map<string, Known>();
    const seen = (...sessions: string[]): [string, string, string][] => peopleIn(sessions.map((s) => here(s)), known).map((p) => [p.session, p.name, p.colour]);
    const three = seen('lumend-web.0-1', 'lumend-web.1-1', 'lumend-web.2-1');
    assert.deepEqual(three.map(([, name]) => name), ['Guest', 'Guest 2', 'Guest 3']);
    assert.equal(new Set(three.map(([, , colour]) => colour)).size, 3);
    assert.deepEqual(seen('lumend-web.1-1', 'lumend-web.2-1'), three.slice(1));
    const again = seen('lumend-web.3-1', 'lumend-web.1-1', 'lumend-web.2-1');
    assert.deepEqual(again.slice(1), three.slice(1));
    assert.deepEqual(again[0]!.slice(1), three[0]!.slice(1), 'what is free is given to who comes');
    const crowd = seen(...Array.from({ length: 20 }, (_, i) => `lumend-web.${i}-2`));
    assert.equal(new Set(crowd.map(([, name]) => name)).size, 20);
});
