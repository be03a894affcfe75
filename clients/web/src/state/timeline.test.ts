import assert from 'node:assert/strict';
import { signal } from '@preact/signals';
import { test } from 'node:test';
import { FakeTimers } from '../lib/fake_timers';
import type { JsonObject } from '../protocol/rpc';
import { didInWords, fittingName, momentsIn, MOST_NAME_BYTES, Timeline, titleOf } from './timeline';

const TOLD = [
    { scene_rev: 1 },
    { scene_rev: 2, at_ms: 1000, did: 'apply', user: 'ann.0-1', changes: [['set', 'key', 'flux_lm']], n_changes: 1, name: 'bright', named_by: 'ann.0-1' },
    { scene_rev: 4, at_ms: 2000, did: 'undo', user: 'bob.1-1', changes: [['add', 'lamp', 'light']], n_changes: 3 },
    { scene_rev: 5, at_ms: 3000, did: 'revert', user: 'bob.1-1', to: 2, changes: [['remove', 'lamp', 'light']], n_changes: 1 },
    { scene_rev: 9, did: 'apply', user: '', joined: 12, changes: [['set', 'key', 'on']], n_changes: 7 },
];
const settle = (): Promise<void> => new Promise((r) => setImmediate(r));

test('what was done is told in words', () => {
    const list = momentsIn(TOLD);
    assert.deepEqual(list.map((m) => [m.who, didInWords(m, list)]), [
        ['', 'as it began'],
        ['ann', 'brightness of key'],
        ['bob', 'undid lamp added, and 2 more'],
        ['bob', 'back to bright'],
        ['', '12 steps'],
    ]);
    assert.equal(titleOf(list[0], 1), 'revision 1');
    assert.deepEqual(momentsIn('nonsense'), []);
    assert.equal(didInWords(momentsIn([{ did: 'revert', to: 3 }])[0]!, []), 'back to revision 3', 'whose moment is kept no more');
});

function made() {
    const calls: [string, JsonObject][] = [];
    const moment = signal<number | null>(null);
    const shown = signal(9);
    const open = signal(true);
    const changed = signal(0);
    const told: string[] = [];
    const reverted: number[] = [];
    const timeline = new Timeline({
        call: (method, params) => (calls.push([method, params]), Promise.resolve({ moments: TOLD })),
        onError: (error) => assert.fail(error.message),
        announce: (text) => told.push(text),
        open,
        changed,
        moment,
        look: (rev) => {
            moment.value = rev;
            queueMicrotask(() => (shown.value = rev ?? 9));
        },
        shown,
        revert: (rev) => (reverted.push(rev), (moment.value = null), Promise.resolve(true)),
    });
    return { timeline, calls, moment, told, reverted, open, changed };
}

test('a look goes from moment to moment, and its last is now', async () => {
    const { timeline, moment } = made();
    await settle();
    assert.ok(timeline.isNow.value && timeline.index.value === 4);
    timeline.look(timeline.index.value - 1);
    assert.deepEqual([moment.value, timeline.index.value], [5, 3]);
    timeline.look(-Infinity);
    assert.equal(moment.value, 1);
    timeline.look(Infinity);
    assert.equal(moment.value, null, 'now goes on');
});

test('going back is one edit, of a moment alone', async () => {
    const { timeline, reverted, told } = made();
    await settle();
    await timeline.back();
    assert.deepEqual(reverted, [], 'now is no moment to go back to');
    timeline.look(1);
    await timeline.back();
    assert.deepEqual(reverted, [2]);
    assert.match(told.at(-1)!, /as it was: bright/);
});

test('a moment gets a name, and the same name is none', async () => {
    const { timeline, calls, told } = made();
    await settle();
    timeline.look(1);
    await timeline.name('  bright ', 2);
    await timeline.name(' noon ', 2);
    await timeline.name('dusk', 4);
    const named = [
        { scene_rev: 2, name: 'noon' },
        { scene_rev: 4, name: 'dusk' },
    ];
    assert.deepEqual(calls.filter(([m]) => m === 'timeline.name').map(([, p]) => p), named, 'of another moment than is looked at, too');
    assert.match(told.join(), /This moment is noon,The moment of .* is dusk/);
});

test('of a name there is as much as has room, which is told in bytes, and no part of a letter', () => {
    const bytes = (text: string): number => new TextEncoder().encode(text).length;
    for (const letter of ['a', 'ä', '€', '𝄞']) {
        const all = letter.repeat(MOST_NAME_BYTES);
        const most = Math.floor(MOST_NAME_BYTES / bytes(letter));
        assert.equal(fittingName(all), letter.repeat(most));
        assert.equal(fittingName(`x${all}`), `x${letter.repeat(Math.floor((MOST_NAME_BYTES - 1) / bytes(letter)))}`);
    }
    assert.equal(fittingName('short'), 'short');
});

test('a moment that is not listed any more is none of those that are: nothing is said of it, and keys go to those beside it', async () => {
    const { timeline, moment, reverted } = made();
    await settle();
    moment.value = 3; // between revisions 2 and 4
    assert.deepEqual([timeline.here.value, timeline.isNow.value], [undefined, false]);
    await timeline.back();
    assert.deepEqual([reverted, moment.value], [[], 3]);
    timeline.step(-1);
    assert.equal(moment.value, 2);
    moment.value = 3;
    timeline.step(1);
    assert.equal(moment.value, 4);
    moment.value = 3;
    timeline.look(timeline.moments.value.length - 1);
    assert.equal(moment.value, null);
});

test('what nobody sees is not asked for; opened, it is', () => {
    const timers = new FakeTimers();
    try {
        const { calls, open, changed } = made();
        timers.tick(1000);
        const first = calls.length;
        open.value = false;
        changed.value++;
        timers.tick(1000);
        assert.equal(calls.length, first);
        open.value = true;
        assert.equal(calls.length, first + 1);
        changed.value++;
        timers.tick(1000);
        assert.equal(calls.length, first + 2);
    } finally {
        timers.reset();
    }
});

test('played from now it begins at the first, draws each, and ends at now', async () => {
    const { timeline, moment, told } = made();
    await settle();
    timeline.speed.value = 1e6;
    const seen: (number | null)[] = [];
    moment.subscribe((m) => seen.push(m));
    await timeline.play();
    assert.deepEqual(seen, [null, 1, 2, 4, 5, null]);
    assert.equal(told.at(-1), 'Played to now');
    assert.ok(!timeline.playing.value);
});
