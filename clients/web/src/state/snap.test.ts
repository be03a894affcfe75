import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { Vec3 } from '../lib/vec';
import { Snap, snapAngles, snapPoint, snapTo, stepTowards } from './snap';

test('what is moved stops at the grid along the axes that it moves on, and keeps the others', () => {
    const near = (a: Vec3, b: Vec3): void => a.forEach((v, i) => assert.ok(Math.abs(v - b[i]!) < 1e-9, `${a} and ${b}`));
    near(snapPoint([1.04, 2.785, -0.26], [0.5, 2.785, 0.33], 0.1), [1, 2.785, -0.3]);
    near(snapPoint([1.3, 2, 3], [1, 2, 3], 0.25), [1.25, 2, 3]);
});

test('a key gets from anywhere to the next place of the grid, and from there to the next one', () => {
    const at = (x: number, towards: number): number => stepTowards([x + towards, 5, 5.001 * 1], [x, 5, 5], 0.1)[0];
    assert.ok(Math.abs(at(0.13, 0.02) - 0.2) < 1e-9);
    assert.ok(Math.abs(at(0.13, -0.02) - 0.1) < 1e-9);
    // Numbers are kept to a millimetre: 0.3 is none of the multiples of 0.1 in doubles.
    for (const x of [0.3, 0.7, -0.6, 0.1 + 0.2]) {
        assert.ok(Math.abs(at(x, 0.02) - (x + 0.1)) < 1e-6, `${x} up to ${at(x, 0.02)}`);
        assert.ok(Math.abs(at(x, -0.02) - (x - 0.1)) < 1e-6, `${x} down to ${at(x, -0.02)}`);
    }
    assert.deepEqual(stepTowards([1, 2, 3], [1, 2, 3], 0.1), [1, 2, 3], 'nowhere');
});

test('Ctrl snaps where the switch is off, and lets go where it is on', () => {
    const snap = new Snap();
    const held = { ctrlKey: true, metaKey: false };
    const free = { ctrlKey: false, metaKey: false };
    assert.deepEqual([snap.how(free, false), snap.how(held, false), snap.how(held, true)], ['free', 'grid', 'step']);
    snap.on.value = true;
    assert.deepEqual([snap.how(free, false), snap.how(held, false), snap.how(free, true)], ['grid', 'free', 'step']);
    assert.equal(snapTo(52, 15), 45);
    assert.equal(snapTo(-53, 15), -60);
});

test('angles stop at multiples, and a key turns by one of them', () => {
    assert.deepEqual(snapAngles({ tilt: 37, turn: -52 }, { tilt: 0, turn: 0 }, 'grid', 15), { tilt: 30, turn: -45 });
    assert.equal(snapAngles({ tilt: 179, turn: 0 }, { tilt: 0, turn: 0 }, 'grid', 50).tilt, 180, 'there is no more');
    assert.deepEqual(snapAngles({ tilt: 33, turn: 10 }, { tilt: 30, turn: 10 }, 'step', 15), { tilt: 45, turn: 10 });
    assert.deepEqual(snapAngles({ tilt: 29, turn: 10 }, { tilt: 30, turn: 10 }, 'step', 15), { tilt: 15, turn: 10 });
    assert.deepEqual(snapAngles({ tilt: 90, turn: -178 }, { tilt: 90, turn: 178 }, 'step', 15), { tilt: 90, turn: 180 }, 'the short way');
    assert.deepEqual(snapAngles({ tilt: 3, turn: 88 }, { tilt: 0, turn: 0 }, 'step', 15), { tilt: 15, turn: 90 });
});
