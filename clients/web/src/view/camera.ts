/**
 * The orbit camera and the projection of its picture. Pure functions over plain data.
 *
 * An orbit looks at `target` from `distance` metres; yaw turns about `axis`, pitch lifts above its equator. Picture
 * coordinates are fractions: (0, 0) is the top left corner, (1, 1) the bottom right.
 */
import { add, cross, dot, length, normalize, scale, sub, type Vec3 } from '../lib/vec';
import type { CameraPose } from '../protocol/types';

export interface Orbit {
    target: Vec3;
    distance: number;
    yaw: number;
    pitch: number;
    axis: Vec3;
    vfovDeg: number;
}

const Y: Vec3 = [0, 1, 0];
const X: Vec3 = [1, 0, 0];
/** Short of the pole, where yaw has no meaning and up would flip. */
const MAX_PITCH = (89.5 * Math.PI) / 180;
const MIN_DISTANCE = 0.01;
const MAX_DISTANCE = 1e6;

const radians = (deg: number): number => (deg * Math.PI) / 180;
const clamp = (v: number, lo: number, hi: number): number => Math.min(hi, Math.max(lo, v));

/** A camera without roll turns about Y whatever its own up vector says; a rolled one turns about that. */
function orbitAxis(pose: CameraPose, forward: Vec3): Vec3 {
    const up = normalize(pose.up, Y);
    const right = normalize(cross(forward, up), X);
    const upright = Math.abs(dot(right, Y)) < 1e-3 && dot(cross(right, forward), Y) >= 0;
    return upright ? Y : up;
}

/** Two unit vectors that span the equator of `axis`; for Y they are Z and X. */
function equator(axis: Vec3): { zero: Vec3; quarter: Vec3 } {
    const helper: Vec3 = Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : X;
    const quarter = normalize(cross(axis, helper), X);
    return { zero: cross(quarter, axis), quarter };
}

export function orbitFromPose(pose: CameraPose): Orbit {
    const back = sub(pose.position, pose.target);
    const distance = clamp(length(back), MIN_DISTANCE, MAX_DISTANCE);
    const out = normalize(back, [0, 0, 1]);
    const axis = orbitAxis(pose, scale(out, -1));
    const { zero, quarter } = equator(axis);
    return {
        target: pose.target,
        distance,
        yaw: Math.atan2(dot(out, quarter), dot(out, zero)),
        pitch: clamp(Math.asin(clamp(dot(out, axis), -1, 1)), -MAX_PITCH, MAX_PITCH),
        axis,
        vfovDeg: pose.vfov_deg,
    };
}

export function poseFromOrbit(o: Orbit): CameraPose {
    const { zero, quarter } = equator(o.axis);
    const flat = add(scale(zero, Math.cos(o.yaw)), scale(quarter, Math.sin(o.yaw)));
    const out = add(scale(flat, Math.cos(o.pitch)), scale(o.axis, Math.sin(o.pitch)));
    return { position: add(o.target, scale(out, o.distance)), target: o.target, up: o.axis, vfov_deg: o.vfovDeg };
}

/** Angles in radians; positive yaw moves the eye to the right, positive pitch up. */
export function turn(o: Orbit, yaw: number, pitch: number): Orbit {
    const wrapped = Math.atan2(Math.sin(o.yaw + yaw), Math.cos(o.yaw + yaw));
    return { ...o, yaw: wrapped, pitch: clamp(o.pitch + pitch, -MAX_PITCH, MAX_PITCH) };
}

/** Turns the head instead: the eye stays, the target moves. Angles as in turn(). */
export function look(o: Orbit, yaw: number, pitch: number): Orbit {
    const eye = poseFromOrbit(o).position;
    const turned = turn(o, -yaw, -pitch);
    return { ...turned, target: add(turned.target, sub(eye, poseFromOrbit(turned).position)) };
}

/** Moves the target so that the point under the pointer stays there; dx and dy in fractions of the picture's height. */
export function pan(o: Orbit, dx: number, dy: number): Orbit {
    const { right, up } = basis(poseFromOrbit(o));
    const metres = 2 * o.distance * Math.tan(radians(o.vfovDeg) / 2);
    return { ...o, target: add(o.target, add(scale(right, -dx * metres), scale(up, dy * metres))) };
}

/** factor < 1 moves closer. */
export function zoom(o: Orbit, factor: number): Orbit {
    return { ...o, distance: clamp(o.distance * factor, MIN_DISTANCE, MAX_DISTANCE) };
}

/** The eye walks along its view, and takes what it turns about along. */
export function walk(o: Orbit, metres: number): Orbit {
    return { ...o, target: add(o.target, scale(basis(poseFromOrbit(o)).forward, metres)) };
}

/** Of how far things are in a room: a step that is as large as a zoom by 15 % is outside. */
const STEP = 0.15;

/** What drags and arrow keys do: in a room the head turns, outside the eye orbits; with Ctrl the other of the two. */
export const turnsHead = (room: number | null, other: boolean): boolean => (room === null) === other;

/** Closer or away, in a room forward or back; room: how far things are around an eye in one, else null. factor < 1 is closer. */
export function approach(o: Orbit, room: number | null, factor: number): Orbit {
    return room === null ? zoom(o, factor) : walk(o, -STEP * room * (Math.log(factor) / Math.log(1.15)));
}

/** Looks at a ball from the same side, so near that it fills most of the picture. */
export function frameBall(o: Orbit, centre: Vec3, radius: number, aspect: number): Orbit {
    const half = Math.atan(Math.tan(radians(o.vfovDeg) / 2) * Math.min(1, aspect));
    const distance = (1.25 * Math.max(radius, MIN_DISTANCE)) / Math.sin(half);
    return { ...o, target: centre, distance: clamp(distance, MIN_DISTANCE, MAX_DISTANCE) };
}

/** The eye stays where it is, looks at `point` and turns about it from now on. */
export function retarget(o: Orbit, point: Vec3): Orbit {
    const pose = poseFromOrbit(o);
    return orbitFromPose({ ...pose, target: point, up: o.axis });
}

export interface Basis {
    right: Vec3;
    up: Vec3;
    forward: Vec3;
}

export function basis(pose: CameraPose): Basis {
    const forward = normalize(sub(pose.target, pose.position), [0, 0, -1]);
    const right = normalize(cross(forward, normalize(pose.up, Y)), X);
    return { right, up: cross(right, forward), forward };
}

/** Where a point appears, and how deep it lies along the view; null behind the eye. */
export function project(pose: CameraPose, aspect: number, point: Vec3): { x: number; y: number; depth: number } | null {
    const { right, up, forward } = basis(pose);
    const v = sub(point, pose.position);
    const depth = dot(v, forward);
    if (depth <= 0) return null;
    const half = Math.tan(radians(pose.vfov_deg) / 2) * depth;
    return { x: 0.5 + dot(v, right) / (2 * half * aspect), y: 0.5 - dot(v, up) / (2 * half), depth };
}

/** Direction (not unit: 1 along the view) of the ray through a place in the picture. */
export function rayThrough(pose: CameraPose, aspect: number, x: number, y: number): Vec3 {
    const { right, up, forward } = basis(pose);
    const t = Math.tan(radians(pose.vfov_deg) / 2);
    return add(forward, add(scale(right, (2 * x - 1) * t * aspect), scale(up, (1 - 2 * y) * t)));
}

/** The point under (x, y) at the depth of `point`: moves things parallel to the picture. */
export function dragInPicturePlane(pose: CameraPose, aspect: number, point: Vec3, x: number, y: number): Vec3 | null {
    const at = project(pose, aspect, point);
    if (!at) return null;
    return add(pose.position, scale(rayThrough(pose, aspect, x, y), at.depth));
}

/** The point under (x, y) at the height of `point`: moves things over the floor. Null near the horizon. */
export function dragOverFloor(pose: CameraPose, aspect: number, point: Vec3, x: number, y: number): Vec3 | null {
    const ray = rayThrough(pose, aspect, x, y);
    const t = (point[1] - pose.position[1]) / ray[1];
    const reach = 20 * length(sub(point, pose.position));
    return Number.isFinite(t) && t > 0 && t * length(ray) < reach ? add(pose.position, scale(ray, t)) : null;
}
