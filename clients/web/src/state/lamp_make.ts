/** Lamps as they are put in: what each kind is like at first, where it goes, and how it is aimed. Pure. */
import { add, cross, dot, length, normalize, scale, sub, type Vec3 } from '../lib/vec';
import type { Json, JsonObject } from '../protocol/rpc';
import { stringOr, vec3Or, type Op, type SceneRecord } from '../protocol/types';
import { anchorOf } from './placement';
import { UNITS } from './lights';

/** What the menu says of each. */
export const LAMP_KINDS = {
    point: 'Bulb',
    spot: 'Spot',
    quad: 'Panel',
    disc: 'Downlight',
    sphere: 'Globe',
    directional: 'Sun',
} as const;
export type LampKind = keyof typeof LAMP_KINDS;
export const KIND_NAMES = Object.keys(LAMP_KINDS) as LampKind[];

/** A place on a surface, or in the air: then without a normal. */
export interface Mount {
    point: Vec3;
    normal: Vec3 | null;
}

const DOWN: Vec3 = [0, -1, 0];
/** Of a lamp that is put in: not larger than this share of the distance to what is looked at. */
const LARGEST = 0.12;
const SPOT = { inner_cone_deg: 15, outer_cone_deg: 30 };

const round = (v: Vec3, digits: number): Json => v.map((c) => Number(c.toFixed(digits)) + 0);

/** The edges of a panel that shines along `to`: u x v is there. near: what u is to be like. */
export function edgesTowards(to: Vec3, width: number, height: number, near: Vec3 = [1, 0, 0]): { u: Vec3; v: Vec3 } {
    const n = normalize(to, DOWN);
    const flat = sub(near, scale(n, dot(near, n)));
    const other: Vec3 = Math.abs(n[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0];
    const u = length(flat) > 1e-3 * length(near) ? normalize(flat, [1, 0, 0]) : normalize(sub(other, scale(n, dot(other, n))), [1, 0, 0]);
    return { u: scale(u, width), v: scale(cross(n, u), height) };
}

/**
 * How bright it has to be: EV100 shows 2^EV / 8 cd/m² as middle grey. Half white at r metres from a bulb of flux F has
 * F / (8 π² r²); a spot and a panel send the same light into a part of the directions.
 */
function brightness(kind: LampKind, ev: number, r: number): JsonObject {
    const twoDigits = (v: number, most: number): number => Number(Math.min(Math.max(v, 1), most).toPrecision(2));
    if (kind === 'directional') return { illuminance_lx: twoDigits((Math.PI / 4) * 2 ** ev, UNITS.illuminance_lx.max) };
    const share = kind === 'spot' ? 0.12 : kind === 'quad' || kind === 'disc' ? 0.4 : 1;
    return { flux_lm: twoDigits(share * Math.PI ** 2 * r * r * 2 ** ev, UNITS.flux_lm.max) };
}

function shape(kind: LampKind, towards: Vec3, most: number): JsonObject {
    switch (kind) {
        case 'quad': {
            const { u, v } = edgesTowards(towards, Math.min(0.6, most), Math.min(0.6, most));
            return { u: round(u, 4), v: round(v, 4) };
        }
        case 'disc':
            return { radius: Math.min(0.1, most / 2), direction: round(towards, 4) };
        case 'sphere':
            return { radius: Math.min(0.12, most / 2) };
        case 'spot':
            return { direction: round(towards, 4), ...SPOT };
        case 'directional':
            return { direction: round(normalize([-0.5, -1, -0.35], DOWN), 4) };
        default:
            return {};
    }
}

/** Fields of a light that lights what is looked at, `r` metres away. */
export function newLamp(kind: LampKind, mount: Mount, r: number, ev: number): JsonObject & { kind: LampKind } {
    const most = LARGEST * 2 * r;
    const towards = mount.normal ?? DOWN;
    const lamp = { kind, ...shape(kind, towards, most), ...brightness(kind, ev, r), cct_k: kind === 'directional' ? 5600 : 3000 };
    if (kind === 'directional') return lamp;
    // On a surface, yet not in it: what has an extent everywhere stands off it.
    const gap = kind === 'sphere' ? Math.min(0.12, most / 2) + 0.02 : kind === 'point' ? Math.min(0.15, most) : Math.min(0.01, 0.05 * most);
    return { ...lamp, position: round(mount.normal ? add(mount.point, scale(mount.normal, gap)) : mount.point, 3) };
}

export const isAimed = (light: SceneRecord): boolean => ['spot', 'ies', 'disc', 'quad', 'directional'].includes(stringOr(light.kind, ''));
/** A sun shines from nowhere, so that it has no way to point at something. */
export const canPointAt = (light: SceneRecord): boolean => isAimed(light) && light.kind !== 'directional';

/** Where its light goes; unit. */
export function aimOf(light: SceneRecord): Vec3 {
    if (light.kind !== 'quad') return normalize(vec3Or(light.direction, DOWN), DOWN);
    return normalize(cross(vec3Or(light.u, [1, 0, 0]), vec3Or(light.v, [0, 0, 1])), DOWN);
}

/** The op that turns its light that way; a panel keeps its size, and turns no more about itself than it must. */
export function aimed(light: SceneRecord, towards: Vec3): Op {
    const n = normalize(towards, DOWN);
    if (light.kind !== 'quad') return { op: 'set', id: light.id, path: '/direction', value: round(n, 5) };
    const before = vec3Or(light.u, [1, 0, 0]);
    const { u, v } = edgesTowards(n, length(before), length(vec3Or(light.v, [0, 0, 1])), before);
    return { op: 'set', id: light.id, path: '', value: { u: round(u, 5), v: round(v, 5) } };
}

export const aimedAt = (light: SceneRecord, point: Vec3): Op => aimed(light, sub(point, anchorOf(light)));

/** Degrees: from straight down, and about the vertical from +Z to +X. */
export interface Angles {
    tilt: number;
    turn: number;
}

const DEGREES = 180 / Math.PI;

export function anglesOf(direction: Vec3): Angles {
    const flat = Math.hypot(direction[0], direction[2]);
    const turn = flat < 1e-6 ? 0 : Math.atan2(direction[0], direction[2]) * DEGREES;
    return { tilt: Math.atan2(flat, -direction[1]) * DEGREES, turn };
}

export function directionOf({ tilt, turn }: Angles): Vec3 {
    const [t, a] = [tilt / DEGREES, turn / DEGREES];
    return [Math.sin(t) * Math.sin(a), -Math.cos(t), Math.sin(t) * Math.cos(a)];
}
