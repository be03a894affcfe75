import assert from 'node:assert/strict';
import { test } from 'node:test';
import { signal } from '@preact/signals';
import type { Op, SceneRecord } from '../protocol/types';
import { allAt, fullOf } from './dimming';
import type { Edits } from './edits';
import type { Lamps } from './lamps';
import { Mover } from './mover';
import { SceneMirror } from './scene';
import { Selection } from './selection';
import { Snap } from './snap';
import { Toasts } from './toasts';
import type { ViewLink } from './view';

function desk() {
    const scene = new SceneMirror();
    const lamp = (id: string, x: number) => ({ op: 'add', type: 'light', kind: 'point', id, flux_lm: 100, position: [x, 2, 0] });
    scene.load([lamp('a', 0), lamp('b', 1), lamp('c', 2), { op: 'add', type: 'object', id: 'box', mesh: 'm' }], 1);
    const sent: [string, string, unknown][] = [];
    let gestures = 0;
    const applied: (Op[] | 'undo')[] = [];
    const answer = Promise.resolve(true);
    const edits = {
        set: (id: string, path: string, value: unknown) => sent.push([id, path, value]),
        endGesture: () => gestures++,
        step: 0,
        transaction: (ops: Op[]) => (edits.step++, applied.push(ops), answer),
        undo: () => (edits.step++, applied.push('undo'), Promise.resolve(true)),
    };
    const lamps = { selected: signal<string | null>(null) } as unknown as Lamps;
    const toasts = new Toasts();
    const solo = (): readonly string[] => view.settings.value.solo;
    const view = {
        settings: signal<{ solo: readonly string[] }>({ solo: [] }),
        change: (settings: { solo: readonly string[] }) => (view.settings.value = settings),
    };
    const selection = new Selection({ scene, edits: edits as unknown as Edits, toasts, lamps, view: view as unknown as ViewLink, call: () => Promise.reject(new Error()), onError: () => {} });
    const mover = new Mover({ scene, edits: edits as unknown as Edits, toasts, snap: new Snap(), with: (id) => selection.with(id) });
    return { scene, selection, lamps, mover, toasts, solo, edits, applied, sent, gestures: () => gestures };
}
const CTRL = { ctrlKey: true, metaKey: false, shiftKey: false };
const SHIFT = { ctrlKey: false, metaKey: false, shiftKey: true };
const PLAIN = { ctrlKey: false, metaKey: false, shiftKey: false };

test('a click selects one, with Ctrl it joins the others or leaves them, with Shift all between join', () => {
    const { selection, lamps } = desk();
    const order = ['a', 'b', 'c'];
    selection.click('a', PLAIN, order);
    assert.deepEqual([lamps.selected.value, selection.many.value], ['a', []]);
    selection.click('c', CTRL, order);
    assert.deepEqual([lamps.selected.value, selection.many.value], [null, ['a', 'c']]);
    selection.toggle('box');
    assert.deepEqual(selection.ids.value, ['a', 'c', 'box']);
    selection.toggle('box');
    selection.click('a', CTRL, order);
    assert.deepEqual([lamps.selected.value, selection.many.value], ['c', []], 'one is one as ever');
    selection.click('b', PLAIN, order);
    assert.deepEqual([lamps.selected.value, selection.many.value], ['b', []]);
    selection.click('c', SHIFT, order);
    assert.deepEqual(selection.many.value, ['b', 'c']);
    selection.click('a', SHIFT, order);
    assert.deepEqual([...selection.many.value].sort(), ['a', 'b'], 'a range turns about where it began');
});

test('what it was when it was selected is kept of each, whichever others join or leave', () => {
    const { selection, scene } = desk();
    const now = (id: string): SceneRecord => scene.peek(id)!;
    const was = (id: string): unknown => selection.found(now(id)).flux_lm;
    const set = (id: string, value: number, rev: number): unknown => scene.apply([{ op: 'set', id, path: '/flux_lm', value }], rev);
    selection.set(['a']);
    set('a', 50, 2);
    set('c', 70, 3);
    selection.toggle('c');
    assert.deepEqual([was('a'), was('c')], [100, 70], 'one that was alone keeps its own, one that joins has what it is now');
    set('c', 7, 4);
    selection.toggle('b');
    assert.deepEqual(['a', 'b', 'c'].map(was), [100, 100, 70]);
    assert.deepEqual(allAt([now('a'), now('c')], 1, (l) => fullOf(l, selection.found(l))).map((op) => op.op === 'set' && op.value), [100, 70], '100 % of all');
    selection.toggle('c');
    selection.toggle('c');
    assert.deepEqual(['a', 'c'].map(was), [100, 7], 'one that left comes anew');
    selection.clear();
    assert.equal(was('a'), 50, 'of what is not selected nothing is kept');
    selection.set(['a', 'late']);
    scene.apply([{ op: 'add', type: 'light', kind: 'point', id: 'late', flux_lm: 10, position: [0, 0, 0] }], 5);
    assert.equal(was('late'), 10, 'selected before its record came');
    set('late', 1, 6);
    assert.equal(was('late'), 10);
});

test('an object is no lamp: by its mark it is selected alone, or not at all, and it shines for nobody', () => {
    const { selection, lamps, solo, toasts } = desk();
    selection.set(['a']);
    selection.solo();
    selection.set(['a', 'box']);
    selection.click('box', PLAIN);
    assert.deepEqual([lamps.selected.value, selection.many.value], [null, ['box']]);
    selection.solo();
    assert.deepEqual([solo(), toasts.announced.value.trim()], [['a'], 'No lamp is selected'], 'what shines alone stays');
    selection.click('box', PLAIN);
    assert.deepEqual(selection.ids.value, []);
});

test('whatever else selects a lamp, the others are let go; what is gone is not selected', () => {
    const { selection, lamps, scene } = desk();
    selection.set(['a', 'b', 'box']);
    scene.apply([{ op: 'remove', id: 'b' }], 2);
    selection.forgetIfGone();
    assert.deepEqual(selection.ids.value, ['a', 'box']);
    lamps.selected.value = 'c';
    assert.deepEqual(selection.ids.value, ['c']);
    selection.set(['box']);
    assert.deepEqual([lamps.selected.value, selection.many.value], [null, ['box']], 'an object is no lamp of the list');
});

test('a hand on one of several takes all along as one gesture; on another one, that alone', () => {
    const { selection, mover, sent, gestures, toasts } = desk();
    selection.set(['a', 'box']);
    mover.grab('a');
    mover.by([0.26, 0, 0]);
    mover.by([0.26, 0, 0.04], 'grid');
    assert.deepEqual(sent.slice(2), [['a', '/position', [0.3, 2, 0]], ['box', '/transform', { translate: [0.3, 0, 0] }]]);
    assert.equal(gestures(), 0);
    mover.end();
    assert.equal(gestures(), 1);
    assert.match(toasts.announced.value, /^a moved to .* and 1 more with it$/);
    sent.length = 0;
    mover.grab('c');
    mover.by([0, 1, 0]);
    assert.deepEqual(sent, [['c', '/position', [2, 3, 0]]]);
});

test('as many are shown alone as the server takes: sixteen names, of which that of a whole group is one', () => {
    const { scene, selection, solo, toasts } = desk();
    const lamp = (id: string, group?: string) => ({ op: 'add', type: 'light', kind: 'point', id, flux_lm: 1, position: [0, 0, 0], ...(group ? { group } : {}) });
    const row = Array.from({ length: 20 }, (_, i) => `row-${i}`);
    scene.load([...row.map((id) => lamp(id, 'row')), ...Array.from({ length: 17 }, (_, i) => lamp(`l${i}`)), lamp('one', 'half'), lamp('other', 'half')], 1);
    selection.set([...row, 'one']);
    selection.solo();
    assert.deepEqual(solo(), ['row', 'one'], 'of a part of a group each is named');
    assert.match(toasts.announced.value, /^Only 21 lamps shine/);
    selection.set(['row-3', 'row-4']);
    selection.solo();
    assert.deepEqual(solo(), [], 'they shone alone, with their group');
    selection.set(Array.from({ length: 16 }, (_, i) => `l${i}`));
    selection.solo();
    assert.equal(solo().length, 16);
    selection.set(Array.from({ length: 17 }, (_, i) => `l${i}`));
    selection.solo();
    assert.equal(solo().length, 16, 'what the server would refuse is not asked for');
    assert.match(toasts.shown.value.at(-1)!.text, /at most 16 .* these are 17/);
    scene.load([lamp('a', 'row'), lamp('b', 'row'), lamp('row')], 2);
    selection.set(['a', 'b']);
    selection.solo();
    assert.deepEqual(solo(), ['a', 'b'], 'the name of the group is that of another lamp, too');
});

test('a model takes its own lamps along: moved and removed once', async () => {
    const { scene, selection, mover, sent, applied } = desk();
    scene.load([{ op: 'add', type: 'import', id: 'm', asset: 'm.glb' }, { op: 'add', type: 'light', kind: 'point', id: 'm/l', origin: 'm', flux_lm: 1, position: [0, 1, 0] }], 2);
    selection.set(['m', 'm/l']);
    for (const led of ['m', 'm/l']) {
        sent.length = 0;
        mover.grab(led);
        mover.by([1, 0, 0]);
        assert.deepEqual(sent.map(([id]) => id), ['m'], led);
    }
    await selection.remove();
    assert.deepEqual(applied, [[{ op: 'remove', id: 'm' }]]);
    selection.set(['m/l']);
    mover.grab('m/l');
    sent.length = 0;
    mover.by([1, 0, 0]);
    assert.deepEqual(sent.map(([id]) => id), ['m/l']);
});

test('the way back of a removal is its own step, whatever was done meanwhile, and makes nothing of a model anew', async () => {
    const { scene, selection, toasts, edits, applied } = desk();
    const undo = (): void => toasts.shown.value.at(-1)!.actions[0]!.run();
    selection.set(['a', 'b']);
    const removing = selection.remove();
    edits.step++; // another edit, before the answer
    await removing;
    undo();
    assert.deepEqual((applied.at(-1) as Op[]).map((op) => [op.op, op.id]), [['add', 'a'], ['add', 'b']]);
    selection.set(['a', 'b']);
    await selection.remove();
    undo();
    assert.equal(applied.at(-1), 'undo');
    scene.load(['x', 'y'].map((id) => ({ op: 'add', type: 'object', id, origin: 'm', mesh: 'k' })), 2);
    selection.set(['x', 'y']);
    await selection.remove();
    edits.step++;
    const n = applied.length;
    undo();
    assert.equal(applied.length, n);
    assert.match(toasts.shown.value.at(-1)!.text, /^It came with a model/);
});
