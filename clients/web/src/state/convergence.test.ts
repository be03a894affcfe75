import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { JsonObject } from '../protocol/rpc';
import { Convergence, courseInWords, expectedInWords, fitOf, knownError, opacityOf, outlookInWords, type Point } from './convergence';
import { STOP_NAMES, STOPS } from './view';

/** error = at1s * s^slope, at times that grow by a quarter each. */
function falling(at1s: number, slope: number, n = 20): Point[] {
    return Array.from({ length: n }, (_, i) => {
        const s = 0.2 * 1.25 ** i;
        const bound = at1s * s ** slope;
        return { s, bound, rel: bound / 2 };
    });
}

const FRAME = { scene_rev: 1, camera_seq: 1, method: 'path', passes: 1, ms: 1000, converged: false, stopped_by: null };

/** One sample a second, with an error of 0.4 / sqrt(s). */
function refine(c: Convergence, from: number, to: number, more: JsonObject = {}): void {
    for (let spp = from; spp <= to; spp++) {
        const bound = 0.4 / Math.sqrt(spp);
        c.stats({ ...FRAME, spp, error: { rel: bound / 2, bound, fresh: 1 }, ...more }, 1000 * spp);
    }
}

test('a fit finds the slope, through noise too, and none that cannot be', () => {
    for (const slope of [-0.5, -0.8, -0.2]) {
        const fit = fitOf(falling(0.3, slope))!;
        assert.ok(Math.abs(fit.slope - slope) < 1e-9 && Math.abs(fit.at1s / 0.3 - 1) < 1e-9, `${slope}: ${JSON.stringify(fit)}`);
    }
    // 3 % up and down in turn over the 10 points of the last factor of 8, h = ln 1.25 apart: the slope is off by
    // 5 * 0.03 h / (82.5 h^2) = 0.0082.
    const noisy = falling(0.3, -0.5).map((p, i) => ({ ...p, bound: p.bound * (i % 2 ? 1.03 : 0.97) }));
    assert.ok(Math.abs(fitOf(noisy)!.slope + 0.5) < 0.009, `${fitOf(noisy)!.slope}`);
    assert.equal(fitOf(falling(0.3, 0.4))!.slope, 0, 'error does not grow');
    assert.equal(fitOf(falling(0.3, -3))!.slope, -1, 'nor fall faster than 1 / time');
    const bent = [...falling(0.3, 0, 30), ...falling(0.3, -0.5, 50).slice(30)];
    assert.ok(Math.abs(fitOf(bent)!.slope + 0.5) < 1e-9, 'what was long ago does not count');
});

test('too few points, or too near in time, are no fit', () => {
    assert.equal(fitOf([]), null);
    assert.equal(fitOf(falling(0.3, -0.5, 3)), null);
    assert.equal(fitOf(falling(0.3, -0.5, 20).map((p) => ({ ...p, s: 5 + p.s / 100 }))), null);
});

test('an error is predicted, and noted once it is reached', () => {
    const c = new Convergence();
    assert.deepEqual(c.outlook('10 %', 1024), { is: 'unknown' });
    refine(c, 1, 9);
    assert.equal(c.course.value.s, 9);
    for (const [stop, s] of [['10 %', 16], ['5 %', 64], ['1 %', 1600]] as const) {
        const ahead = c.outlook(stop, 1024);
        assert.ok(ahead.is === 'ahead' && Math.abs(ahead.s / s - 1) < 1e-9, `${JSON.stringify(ahead)}, ${s} expected`);
    }
    assert.deepEqual(c.outlook('fast', 1024), { is: 'reached', s: 1 });
    assert.deepEqual(c.outlook('exact', 1024), { is: 'ahead', s: 1024 });
    refine(c, 10, 20);
    assert.deepEqual(c.outlook('10 %', 1024), { is: 'reached', s: 16 });
    refine(c, 21, 21, { stopped_by: 'spp', converged: true });
    assert.deepEqual(c.outlook('exact', 1024), { is: 'reached', s: 21 });
    assert.equal(outlookInWords('1 %', { is: 'ahead', s: 17.4 }, 5), '1 % in about 12 s.');
});

test('what the server expects of the chosen error is told with its range, while it goes on', () => {
    const c = new Convergence();
    const predicted = { stopped_by: 'error', ms: 14000, ms_least: 10000, ms_most: 32000, error: 0.01 };
    const frame = { ...FRAME, spp: 12, spent_ms: 2000, error: null };
    const expected = (more: JsonObject) => (c.stats({ ...frame, ...more }, 0), c.course.value.expected);
    assert.deepEqual(expected({ predicted }), { s: 12, least: 8, most: 30 });
    assert.equal(expectedInWords('1 %', expected({ predicted })!), '1 % in about 12 s (8 s to 30 s).');
    assert.match(expectedInWords('1 %', expected({ predicted: { ...predicted, ms_most: null } })!), /8 s or more/);
    assert.equal(expected({ predicted: { ...predicted, stopped_by: 'spp' } }), null);
    assert.equal(expected({ predicted, converged: true }), null);
    assert.equal(expected({ predicted: null }), null);
});

test('of a picture that stays black no error is in sight', () => {
    const c = new Convergence();
    c.stats({ ...FRAME, spp: 64, error: null }, 1000);
    assert.deepEqual(c.outlook('10 %', 1024), { is: 'unknown' });
    c.stats({ ...FRAME, spp: 64, error: null, stopped_by: 'black', converged: true }, 1100);
    assert.deepEqual(c.outlook('10 %', 1024), { is: 'not in sight' });
});

test('what is flat, or more than a day away, is not in sight', () => {
    const flat = new Convergence();
    const slow = new Convergence();
    for (let i = 1; i <= 9; i++) {
        flat.stats({ ...FRAME, spp: i, error: { rel: 0.1, bound: 0.2, fresh: 1 } }, 1000 * i);
        slow.stats({ ...FRAME, spp: i, error: { rel: 0.1, bound: 0.2 * i ** -0.1, fresh: 1 } }, 1000 * i);
    }
    assert.deepEqual(flat.outlook('1 %', 1024), { is: 'not in sight' });
    assert.deepEqual(slow.outlook('1 %', 1024), { is: 'not in sight' });
    assert.equal(outlookInWords('1 %', flat.outlook('1 %', 1024), 9), '1 % is not in sight.');
});

test('another picture begins anew, and more of the same one goes on', () => {
    const c = new Convergence();
    const points = (): number => c.course.value.points.length;
    refine(c, 1, 9);
    assert.equal(points(), 9);
    refine(c, 10, 10, { camera_seq: 2 });
    assert.equal(points(), 10, 'a budget is no other picture');
    c.stats({ ...FRAME, camera_seq: 3, spp: 1, error: { rel: 0.2, bound: 0.4, fresh: 1 } }, 1000);
    assert.deepEqual([points(), c.course.value.s], [1, 1], 'a camera that moved is');
    refine(c, 2, 5, { camera_seq: 3 });
    c.stats({ ...FRAME, camera_seq: 3, scene_rev: 2, spp: 5, passes: 0, ms: 10, error: { rel: 0.2, bound: 0.4, fresh: 1 } }, 6000);
    assert.equal(points(), 1, 'so is a lamp that was dimmed without a ray');
    assert.equal(c.course.value.s, 6, 'but the work that is in it counts');
    c.reset();
    assert.equal(points(), 0);
});

test('the rough picture belongs to the whole one; a rest takes no time', () => {
    const c = new Convergence();
    c.stats({ ...FRAME, spp: 0, error: { rel: 2, bound: 3, fresh: 1 } }, 100);
    assert.deepEqual([c.course.value.points.length, c.course.value.s], [0, 1]);
    c.stats({ ...FRAME, spp: 1, error: { rel: 0.2, bound: 0.4, fresh: 1 }, stopped_by: 'error', converged: true }, 1100);
    assert.deepEqual([c.course.value.points.length, c.course.value.s], [1, 2]);
    c.stats({ ...FRAME, camera_seq: 2, spp: 2, error: { rel: 0.1, bound: 0.3, fresh: 1 } }, 900000);
    assert.deepEqual([c.course.value.points.length, c.course.value.s], [2, 3], 'a quarter of an hour later');
});

test('an error of the pictures before is no point, and pales', () => {
    const c = new Convergence();
    c.stats({ ...FRAME, spp: 1, error: { rel: 0.2, bound: 0.4, fresh: 0.1 } }, 0);
    c.stats({ ...FRAME, spp: 2, error: null }, 100);
    assert.equal(c.course.value.points.length, 0);
    const error = { rel: 0.031, bound: 0.042, fresh: 1 };
    assert.equal(knownError(error), 'At most 4.2 % off (about 3.1 %), 95 % sure.');
    assert.match(knownError({ ...error, rel: 0 }), /less than can be told from noise/);
    assert.match(knownError(null), /not known yet/);
    assert.match(knownError({ ...error, bound: 1.8 }), /is being measured: so far all that is sure is less than 180.%/);
    assert.ok(opacityOf(0) < opacityOf(0.5) && opacityOf(1) === 1);
});

test('points near in time are one, so that a picture at rest for an hour has few', () => {
    const c = new Convergence();
    refine(c, 1, 14400);
    assert.ok(c.course.value.points.length < 600, `${c.course.value.points.length} points`);
    assert.equal(c.course.value.points.at(-1)!.s, 14400);
});

test('the curve is told in words', () => {
    assert.match(courseInWords([], 0.01), /nothing measured yet/);
    const words = courseInWords(falling(0.1, -0.5, 12), 0.01);
    assert.equal(words, 'Error over time: at most 22 % after 0.2 s, at most 6.6 % after 2 s, 12 points; refined until 1 %');
});

test('the positions go from fast to exact', () => {
    const targets = STOP_NAMES.map((name) => STOPS[name] ?? 0);
    assert.deepEqual(targets, [...targets].sort((a, b) => b - a));
    assert.deepEqual([STOP_NAMES[0], STOP_NAMES.at(-1)], ['fast', 'exact']);
});
