/** The ops that put several records into an order: aligned, spread, into tiles, and turned. A part of the page that comes when it is wanted. Pure. */
import { add, cross, dot, length, scale, sub, type Vec3 } from '../lib/vec';
import type { JsonObject } from '../protocol/rpc';
import { vec3Or, type Op, type SceneRecord } from '../protocol/types';
import { aimed, aimOf, anglesOf, directionOf, isAimed, type Angles } from './lamp_make';
import { common, hasPlace, placedAt } from './many';
import { anchorOf, placementOf } from './placement';

const along = (record: SceneRecord, axis: number, v: number): Op =>
    placedAt(record, anchorOf(record).map((old, i) => (i === axis ? v : old)) as unknown as Vec3);

/** All at that coordinate. */
export const alignOps = (records: readonly SceneRecord[], axis: number, v: number): Op[] => records.filter(hasPlace).map((r) => along(r, axis, v));

/** Equal gaps along one axis; the outermost stay. */
export function distributeOps(records: readonly SceneRecord[], axis: number): Op[] {
    const at = (r: SceneRecord): number => anchorOf(r)[axis]!;
    const sorted = records.filter(hasPlace).sort((a, b) => at(a) - at(b));
    if (sorted.length < 3) return [];
    const from = at(sorted[0]!);
    const gap = (at(sorted[sorted.length - 1]!) - from) / (sorted.length - 1);
    return sorted.slice(1, -1).map((r, i) => along(r, axis, from + (i + 1) * gap));
}

/** Into the middles of the tiles of a ceiling, as it is laid over the floor of sensor.place: the same cut at both ends. Each goes to the
 *  nearest tile that none has yet, those that are nearest to one first. null: there are fewer tiles than lamps. */
export function tileOps(records: readonly SceneRecord[], floor: JsonObject, tileM: number): Op[] | null {
    const [u, v] = [vec3Or(floor.u, [1, 0, 0]), vec3Or(floor.v, [0, 0, 1])];
    const middle = vec3Or(floor.position, [0, 0, 0]);
    const [across, down] = [scale(u, tileM / length(u)), scale(v, tileM / length(v))];
    const [columns, rows] = [u, v].map((edge) => Math.max(1, Math.floor(length(edge) / tileM + 1e-6))) as [number, number];
    const placed = records.filter(hasPlace);
    if (placed.length > columns * rows) return null;
    const cells = placed.map((record) => {
        const off = sub(anchorOf(record), middle);
        const cell = (edge: Vec3, n: number): number => dot(off, edge) / (tileM * tileM) + n / 2 - 0.5;
        return { record, at: [cell(across, columns), cell(down, rows)] as const };
    });
    const miss = ({ at }: (typeof cells)[number]): number => Math.hypot(at[0] - Math.round(at[0]), at[1] - Math.round(at[1]));
    const taken = new Set<number>();
    return cells.sort((a, b) => miss(a) - miss(b)).map(({ record, at }) => {
        const [i, j] = nearestFree(at, columns, rows, taken);
        taken.add(i + j * columns);
        const flat = add(middle, add(scale(across, i + 0.5 - columns / 2), scale(down, j + 0.5 - rows / 2)));
        const up = cross(down, across);
        const lift = scale(up, dot(sub(anchorOf(record), flat), up) / dot(up, up));
        return placedAt(record, add(flat, lift));
    });
}

/** Rings about the cell that it is in, or is next to, until no ring can have a nearer one. */
export function nearestFree([x, y]: readonly [number, number], columns: number, rows: number, taken: Pick<ReadonlySet<number>, 'has'>): [number, number] {
    const [cx, cy] = [clampTo(Math.round(x), columns), clampTo(Math.round(y), rows)];
    /** What ring r is away at least, along the axis that it is r away by, and along the other. */
    const least = (v: number, c: number): [number, number] => (Math.abs(v - c) <= 0.5 ? [-0.5, 0] : [Math.abs(v - c), Math.abs(v - c)]);
    const [[ownX, otherX], [ownY, otherY]] = [least(x, cx), least(y, cy)];
    let [best, nearest]: [[number, number], number] = [[cx, cy], Infinity];
    for (let r = 0; r <= Math.max(columns, rows); r++) {
        if (r > 0 && Math.min(Math.hypot(r + ownX, otherY), Math.hypot(otherX, r + ownY)) >= nearest) break;
        for (let j = Math.max(0, cy - r); j <= Math.min(rows - 1, cy + r); j++) {
            const step = r === 0 || Math.abs(j - cy) === r ? 1 : 2 * r;
            for (let i = cx - r; i <= cx + r; i += step) {
                const away = Math.hypot(i - x, j - y);
                if (i < 0 || i >= columns || away >= nearest || taken.has(i + j * columns)) continue;
                [best, nearest] = [[i, j], away];
            }
        }
    }
    return best;
}

const clampTo = (i: number, n: number): number => Math.min(n - 1, Math.max(0, i));

export const anglesOfAll = (records: readonly SceneRecord[]): { tilt: number | null; turn: number | null } => {
    const angles = records.map((r) => anglesOf(aimOf(r)));
    return { tilt: common(angles.map((a) => a.tilt)), turn: common(angles.map((a) => a.turn)) };
};

/** One of the angles for all; each keeps its other one. */
export const aimOps = (records: readonly SceneRecord[], part: Partial<Angles>): Op[] =>
    records.filter(isAimed).map((r) => aimed(r, directionOf({ ...anglesOf(aimOf(r)), ...part })));

/** About the vertical, as an object or a model stands; null: it is none, or a matrix places it. */
export const yawOf = (record: SceneRecord): number | null => (record.type === 'light' ? null : (placementOf(record)?.rotateDeg[1] ?? null));

export function yawOps(records: readonly SceneRecord[], deg: number): Op[] {
    return records.flatMap((r) => {
        const [x, , z] = placementOf(r)?.rotateDeg ?? [0, 0, 0];
        if (yawOf(r) === null) return [];
        const whole = r.transform === undefined || r.transform === null;
        return [{ op: 'set', id: r.id, path: whole ? '/transform' : '/transform/rotate_deg', value: whole ? { rotate_deg: [x, deg, z] } : [x, deg, z] } as Op];
    });
}
