/** What photometric files say, as the server tells it, and the places of lamps that are made in rows. Pure. */
import { newId } from '../lib/ids';
import { add, cross, dot, length, normalize, scale, sub, type Vec3 } from '../lib/vec';
import { isObject, type Json, type JsonObject } from '../protocol/rpc';
import { numberOr, stringOr, vec3Or, type Op, type SceneRecord } from '../protocol/types';
import { aimOf, type Mount } from './lamp_make';
import { nameOf } from './lights';
import { anchorOf, anchoredAt } from './placement';
import { addOf } from './scene_ops';

/** Candela by the angle from where the lamp aims, in planes through that. */
export interface Polar {
    gammaDeg: readonly number[];
    c0: readonly number[];
    c90: readonly number[];
    c180: readonly number[];
    c270: readonly number[];
}

export interface Facts {
    /** Of maker and luminaire; "": the file has none. */
    name: string;
    fluxLm: number;
    /** null: the file does not say. */
    watts: number | null;
    beamDeg: readonly [number, number];
    /** Of the opening, metres: along C 0, along C 90, height. */
    size: Vec3;
    /** UGR in the room of catalogues: crosswise, endwise. null: it has no luminance, its opening is a point. */
    ugr: readonly [number, number] | null;
    polar: Polar | null;
    warnings: readonly string[];
}

const numbers = (v: Json | undefined): number[] => (Array.isArray(v) ? v.map((n) => numberOr(n, 0)) : []);

export function factsOf(told: JsonObject): Facts {
    const p = told.polar_cd;
    const [across = 0, along = 0] = numbers(told.beam_deg);
    const glare = Array.isArray(told.ugr) && told.ugr.length === 2 ? told.ugr : null;
    return {
        name: stringOr(told.name, ''),
        fluxLm: numberOr(told.flux_lm, 0),
        watts: typeof told.watts === 'number' ? told.watts : null,
        beamDeg: [across, along],
        size: vec3Or(told.size, [0, 0, 0]),
        ugr: glare ? [numberOr(glare[0], 0), numberOr(glare[1], 0)] : null,
        polar: isObject(p)
            ? { gammaDeg: numbers(p.gamma_deg), c0: numbers(p.c0), c90: numbers(p.c90), c180: numbers(p.c180), c270: numbers(p.c270) }
            : null,
        warnings: Array.isArray(told.warnings) ? told.warnings.filter((w) => typeof w === 'string') : [],
    };
}

/** As catalogues print it: of the room by which luminaires are compared. */
export function glareText([crosswise, endwise]: readonly [number, number]): string {
    const [a, b] = [crosswise.toFixed(1), endwise.toFixed(1)];
    return a === b ? a : `${a} crosswise, ${b} endwise`;
}

export const GLARE_TITLE = 'Of a room of 4H × 8H that reflects 70, 50 and 20 %, full of these luminaires (CIE 190)';

/** A closed curve of two opposite planes: down is where the lamp aims, 1 the largest intensity of all planes. */
export function polarPath(polar: Polar, planes: 'c0' | 'c90'): string {
    const most = Math.max(...polar.c0, ...polar.c90, ...polar.c180, ...polar.c270, 1e-9);
    const [right, left] = planes === 'c0' ? [polar.c0, polar.c180] : [polar.c90, polar.c270];
    const at = (cd: number, deg: number, side: number): string => {
        const g = (deg * Math.PI) / 180;
        const r = cd / most;
        return `${(side * r * Math.sin(g)).toFixed(3)} ${(r * Math.cos(g)).toFixed(3)}`;
    };
    const there = polar.gammaDeg.map((g, i) => at(right[i] ?? 0, g, 1));
    const back = polar.gammaDeg.map((g, i) => at(left[i] ?? 0, g, -1)).reverse();
    return `M${[...there, ...back].join('L')}Z`;
}

/** "maker/Spot 12.ies" -> "Spot 12" */
export const stemOf = (asset: string): string => (asset.split('/').pop() ?? asset).replace(/\.[^.]*$/, '');

/** True when each word is a part of its path or of what its file is called. */
export function found(asset: string, name: string, words: readonly string[]): boolean {
    const text = `${asset} ${name}`.toLowerCase();
    return words.every((word) => text.includes(word));
}

const DOWN: Vec3 = [0, -1, 0];
const millimetres = (v: Vec3): Json => v.map((c) => Math.round(c * 1000) / 1000 + 0);
/** Neutral white: a file does not tell the colour of its light. */
const CCT_K = 4000;

/** A lamp of the file on a surface, which it shines away from. heightM: of its opening, so that it stands off the surface. */
export function luminaireOp(id: string, asset: string, mount: Mount, heightM: number): Op {
    const towards = normalize(mount.normal ?? DOWN, DOWN);
    const position = add(mount.point, scale(towards, mount.normal ? heightM / 2 + 0.01 : 0));
    const direction = towards.map((c) => Number(c.toFixed(4)) + 0);
    return { op: 'add', type: 'light', id, kind: 'ies', asset, position: millimetres(position), direction, cct_k: CCT_K };
}

/** Columns along `across`, rows along `along`. */
export interface Rows {
    columns: number;
    rows: number;
    /** Metres, from one lamp to the next. */
    across: Vec3;
    along: Vec3;
    /** Of the first lamp; null: where it is. */
    from: Vec3 | null;
}

/** Lamps that an array makes at most. */
export const MOST_LAMPS = 400;

/** Which ways rows go on the surface that it hangs from: over the floor, or along a wall and up. */
export function axesOf(light: SceneRecord): { across: Vec3; along: Vec3 } {
    const n = aimOf(light);
    if (Math.abs(n[1]) > Math.SQRT1_2) return { across: [1, 0, 0], along: [0, 0, 1] };
    return { across: normalize(cross([0, 1, 0], n), [1, 0, 0]), along: [0, 1, 0] };
}

/** In the middles of equal cells of a floor, as `sensor.place` tells it, at the height of the lamp. */
export function spreadOver(light: SceneRecord, floor: JsonObject, columns: number, rows: number): Rows {
    const [u, v] = [vec3Or(floor.u, [1, 0, 0]), vec3Or(floor.v, [0, 0, 1])];
    const [across, along] = [scale(u, 1 / columns), scale(v, 1 / rows)];
    const corner = sub(vec3Or(floor.position, [0, 0, 0]), scale(add(u, v), 0.5));
    const first = add(corner, scale(add(across, along), 0.5));
    const lift = dot(sub(anchorOf(light), first), DOWN);
    return { columns, rows, across, along, from: add(first, scale(DOWN, lift)) };
}

/** The lamp becomes the first of all, and all of one group, so that they are dimmed as one. */
export function arrayOps(light: SceneRecord, { columns, rows, across, along, from }: Rows, taken: (id: string) => boolean): Op[] {
    const first = from ?? anchorOf(light);
    const stem = nameOf(light).replace(/-\d+$/, '');
    const group = stringOr(light.group, '') || stem.replace(/[^A-Za-z0-9_.:/-]+/g, '-').slice(0, 64);
    const used = new Set<string>();
    const ops: Op[] = [{ op: 'set', id: light.id, path: '', value: { group } }];
    if (from) ops.push({ op: 'set', id: light.id, ...anchoredAt(light, from) });
    for (let i = 1; i < columns * rows; i++) {
        const id = newId(stem, (name) => used.has(name) || taken(name));
        used.add(id);
        const place = add(first, add(scale(across, i % columns), scale(along, Math.floor(i / columns))));
        ops.push({ ...addOf(light, id), group, position: millimetres(place) } as Op);
    }
    return ops;
}

export const spacingOf = (rows: Rows): [number, number] => [length(rows.across), length(rows.along)];
