import assert from 'node:assert/strict';
import { test } from 'node:test';
import { add, cross, dot, length, normalize, scale, sub, type Vec3 } from '../lib/vec';
import type { CameraPose } from '../protocol/types';
import * as camera from './camera';

const POSES: CameraPose[] = [
    { position: [0, 2, 7.4], target: [0, 1.95, 0], up: [0, 1, 0], vfov_deg: 39 },
    { position: [-3, 8, -2], target: [1, 0.5, 4], up: [0, 1, 0], vfov_deg: 60 },
    { position: [1e4, 3, 1e4], target: [1e4, 2, 1e4 - 5], up: [0, 1, 0], vfov_deg: 20 },
    { position: [0, 0, 5], target: [0, 0, 0], up: [0.5, Math.sqrt(0.75), 0], vfov_deg: 45 }, // rolled by 30 degrees
    { position: [2, 5, 0], target: [0, 0, 0], up: [0, 0, 1], vfov_deg: 45 }, // Z up
];
/** A few roundings of doubles of the size of the largest coordinate, 1e4. */
const TOLERANCE = 1e-10;

function close(a: number, b: number, tolerance = TOLERANCE): void {
    assert.ok(Math.abs(a - b) <= tolerance * Math.max(1, Math.abs(b)), `${a} is not ${b}`);
}

function closeVec(a: Vec3, b: Vec3): void {
    a.forEach((v, i) => close(v, b[i]!));
}

test('an orbit made from a pose shows the same picture', () => {
    for (const pose of POSES) {
        const again = camera.poseFromOrbit(camera.orbitFromPose(pose));
        closeVec(again.position, pose.position);
        closeVec(again.target, pose.target);
        const a = camera.basis(again);
        const b = camera.basis(pose);
        closeVec(a.right, b.right);
        closeVec(a.up, b.up);
    }
});

test('turning keeps target, distance and horizon; a full turn comes back', () => {
    for (const pose of POSES) {
        const start = camera.orbitFromPose(pose);
        let o = start;
        for (let i = 0; i < 16; i++) {
            o = camera.turn(o, Math.PI / 8, 0);
            const p = camera.poseFromOrbit(o);
            close(length(sub(p.position, p.target)), start.distance);
            close(dot(camera.basis(p).right, start.axis), 0);
        }
        closeVec(camera.poseFromOrbit(o).position, camera.poseFromOrbit(start).position);
    }
});

test('positive yaw moves the eye to the right, positive pitch up', () => {
    const o = camera.orbitFromPose(POSES[0]!);
    const before = camera.poseFromOrbit(o);
    const { right, up } = camera.basis(before);
    assert.ok(dot(sub(camera.poseFromOrbit(camera.turn(o, 0.1, 0)).position, before.position), right) > 0);
    assert.ok(dot(sub(camera.poseFromOrbit(camera.turn(o, 0, 0.1)).position, before.position), up) > 0);
});

test('looking around keeps the eye and the distance, and turns the view to where it says', () => {
    for (const pose of POSES) {
        const o = camera.orbitFromPose(pose);
        const right = camera.poseFromOrbit(camera.look(o, 0.2, 0));
        closeVec(right.position, pose.position);
        close(length(sub(right.target, right.position)), o.distance);
        assert.ok(camera.project(right, 1, pose.target)!.x < 0.5, 'what was in the middle is left of it');
        const up = camera.poseFromOrbit(camera.look(o, 0, 0.1));
        assert.ok(camera.project(up, 1, pose.target)!.y > 0.5, 'or below it');
    }
});

test('pitch stops short of the poles, where the basis stays orthonormal', () => {
    for (const pitch of [10, -10]) {
        const p = camera.poseFromOrbit(camera.turn(camera.orbitFromPose(POSES[0]!), 1, pitch));
        const { right, up, forward } = camera.basis(p);
        for (const v of [right, up, forward]) close(length(v), 1);
        close(dot(right, forward), 0);
        assert.ok(up[1] > 0);
    }
});

test('panning by the whole height moves the target out of the picture by exactly that', () => {
    for (const pose of POSES) {
        const o = camera.orbitFromPose(pose);
        const moved = camera.poseFromOrbit(camera.pan(o, 0.25, -0.5));
        const at = camera.project(moved, 1, o.target)!;
        close(at.x, 0.75, 1e-9);
        close(at.y, 0, 1e-9);
    }
});

test('zoom in and out again is the same distance; limits hold', () => {
    const o = camera.orbitFromPose(POSES[1]!);
    close(camera.zoom(camera.zoom(o, 0.5), 2).distance, o.distance);
    assert.ok(camera.zoom(o, 0).distance > 0);
    assert.ok(Number.isFinite(camera.zoom(o, Infinity).distance));
});

test('a framed ball fits, and touches neither side by more than a fifth', () => {
    for (const aspect of [0.5, 1, 1.78]) {
        const o = camera.frameBall(camera.orbitFromPose(POSES[1]!), [3, 1, 2], 2, aspect);
        const p = camera.poseFromOrbit(o);
        const { right, up } = camera.basis(p);
        for (const side of [right, up, scale(right, -1), scale(up, -1)]) {
            // The silhouette of a ball is inside the cone that touches it: sin, not tan.
            const rim = Math.asin(2 / o.distance);
            const at = camera.project(p, aspect, add(p.position, add(scale(camera.basis(p).forward, 1), scale(side, Math.tan(rim)))))!;
            assert.ok(at.x > 0 && at.x < 1 && at.y > 0 && at.y < 1, `aspect ${aspect}: ${at.x} ${at.y}`);
        }
    }
});

test('project and rayThrough are inverse', () => {
    for (const pose of POSES) {
        for (const [x, y] of [[0, 0], [1, 1], [0.5, 0.5], [0.2, 0.9]] as const) {
            const p = add(pose.position, scale(camera.rayThrough(pose, 1.5, x, y), 3));
            const at = camera.project(pose, 1.5, p)!;
            // Differences of coordinates of 1e4 lose 12 bits.
            close(at.x, x, 1e-8);
            close(at.y, y, 1e-8);
            close(at.depth, 3, 1e-8);
        }
    }
});

test('what is behind the eye is not projected', () => {
    assert.equal(camera.project(POSES[0]!, 1, [0, 2, 9]), null);
});

test('a lamp dragged in the picture plane lands under the pointer at its depth', () => {
    const pose = POSES[1]!;
    const lamp: Vec3 = [0.3, 1.2, 2];
    const depth = camera.project(pose, 1.6, lamp)!.depth;
    const moved = camera.dragInPicturePlane(pose, 1.6, lamp, 0.9, 0.1)!;
    const at = camera.project(pose, 1.6, moved)!;
    close(at.x, 0.9);
    close(at.y, 0.1);
    close(at.depth, depth);
});

test('a lamp dragged over the floor keeps its height; near the horizon it stays', () => {
    const pose = POSES[1]!;
    const lamp: Vec3 = [0.3, 1.2, 2];
    const moved = camera.dragOverFloor(pose, 1.6, lamp, 0.4, 0.8)!;
    close(moved[1], 1.2);
    close(camera.project(pose, 1.6, moved)!.x, 0.4);
    assert.equal(camera.dragOverFloor(POSES[0]!, 1, [0, 1, 0], 0.5, 0.4), null); // looks above the horizon
});

test('retarget keeps the eye and looks at the point', () => {
    const o = camera.orbitFromPose(POSES[1]!);
    const point: Vec3 = [2, 1, 1];
    const p = camera.poseFromOrbit(camera.retarget(o, point));
    closeVec(p.position, camera.poseFromOrbit(o).position);
    const toPoint = normalize(sub(point, p.position), [0, 0, 1]);
    close(length(cross(camera.basis(p).forward, toPoint)), 0);
});

test('in a room the head turns and the eye walks; outside it orbits and comes closer', () => {
    assert.deepEqual([camera.turnsHead(3, false), camera.turnsHead(3, true), camera.turnsHead(null, false), camera.turnsHead(null, true)], [true, false, false, true]);
    for (const pose of POSES) {
        const o = camera.orbitFromPose(pose);
        const { forward } = camera.basis(pose);
        const eye = camera.poseFromOrbit(o).position;
        const on = camera.approach(o, 4, 1 / 1.15); // a notch of the wheel: 15 % of 4 m
        closeVec(camera.poseFromOrbit(on).position, add(eye, scale(forward, 0.6)));
        close(on.distance, o.distance);
        closeVec(camera.poseFromOrbit(camera.approach(on, 4, 1.15)).position, eye);
        close(camera.approach(o, null, 1 / 1.15).distance, o.distance / 1.15);
        closeVec(camera.approach(o, null, 1 / 1.15).target, o.target);
    }
});
