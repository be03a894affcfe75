import assert from 'node:assert/strict';
import { test } from 'node:test';
import { signal } from '@preact/signals';
import type { JsonObject } from '../protocol/rpc';
import { CameraNumbers, type Viewer } from './camera_seq';
import { Reference, type Wanted } from './reference';
import { Stills } from './stills';
import { DEFAULT_POSE, ViewLink } from './view';

test('no two viewers ever give the same number, and frames have room for each', () => {
    const viewers: Viewer[] = ['view', 'reference', 'stills', 'moment'];
    const ends = viewers.map((viewer) => {
        const numbers = new CameraNumbers(viewer);
        return [numbers.next(), Number(Object.entries(numbers).find(([name]) => name === 'end')![1])] as const;
    });
    assert.deepEqual(ends, [[1, 2 ** 30], [2 ** 30, 2 ** 31], [2 ** 31, 3 * 2 ** 30], [3 * 2 ** 30, 2 ** 32]]);
    for (const viewer of viewers) {
        const numbers = new CameraNumbers(viewer);
        const before = numbers.next();
        for (const [of, [from, end]] of ends.entries()) assert.deepEqual([numbers.has(from), numbers.has(end - 1)], Array(2).fill(viewers[of] === viewer));
        assert.ok(!numbers.has(0), 'none was given');
        numbers.begin();
        const seq = numbers.next();
        assert.deepEqual([numbers.has(before), numbers.has(seq), numbers.last], [false, true, seq], 'what was before is of another view');
    }
});

test('frames of views that are opened at once go each to its own, before any reply has come', async () => {
    const opened: { seq: number; answer: (id: number) => void }[] = [];
    const call = (method: string, params: JsonObject): Promise<JsonObject> =>
        method === 'view.open' ? new Promise((done) => opened.push({ seq: Number(params.camera_seq), answer: (view_id) => done({ view_id }) })) : Promise.resolve({});
    const canvas = (): HTMLCanvasElement => ({ dataset: {}, getContext: () => ({}) }) as unknown as HTMLCanvasElement;
    const host = { call, canvas, notify: () => undefined, onError: assert.ifError, announce: () => undefined, save: () => undefined };
    const view = new ViewLink(call, assert.ifError, () => true);
    const what = signal<Wanted>({ pose: DEFAULT_POSE, params: {}, facts: { ev: 8, map: 'none', solo: [] } });
    const reference = new Reference({ ...host, onRefused: assert.ifError, wanted: signal(true), what });
    const stills = new Stills({ ...host, online: signal(true), pose: () => DEFAULT_POSE, params: () => ({}), restSize: () => [8, 6], method: () => null, addsSamples: () => true });
    const viewers = [view, reference, stills];

    void view.open();
    reference.begin();
    void stills.start('picture', 'exr', 0);
    assert.equal(opened.length, 3);
    /** Whose the frames are, of which the nth shows view n + 1. */
    const owners = (): string[] => opened.map(({ seq }, n) => viewers.map((v) => (v.owns(n + 1, seq) ? 'x' : '-')).join(''));
    assert.deepEqual(owners(), ['x--', '-x-', '--x']);
    for (const [n, { answer }] of [...opened.entries()].reverse()) {
        answer(n + 1);
        await new Promise((done) => setImmediate(done));
        assert.deepEqual(owners(), ['x--', '-x-', '--x'], `view ${n + 1} was answered`);
    }
    assert.ok(!view.owns(2, opened[0]!.seq), 'another view’s, whatever its number');
    for (const v of viewers) v.closed();
    assert.deepEqual(owners().slice(1), ['---', '---']);
});
