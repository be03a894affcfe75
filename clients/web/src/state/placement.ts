/** Where records stand in the scene. */
import type { Vec3 } from '../lib/vec';
import { isObject, type Json } from '../protocol/rpc';
import { numberOr, vec3Or, type SceneRecord } from '../protocol/types';

export interface Placement {
    translate: Vec3;
    rotateDeg: Vec3;
    scale: Vec3;
}

/** null: placed by a matrix, which has no such numbers. */
export function placementOf(record: SceneRecord): Placement | null {
    const t = record.transform;
    if (Array.isArray(t)) return null;
    const parts = isObject(t) ? t : {};
    return {
        translate: vec3Or(parts.translate, [0, 0, 0]),
        rotateDeg: vec3Or(parts.rotate_deg, [0, 0, 0]),
        scale: vec3Or(parts.scale, [1, 1, 1]),
    };
}

/** The translation in a matrix of 16 numbers, row-major. */
const TRANSLATION = [3, 7, 11] as const;

/** The point that moves with the record, whatever turns or scales it: the position of a light, the translation of the rest. */
export function anchorOf(record: SceneRecord): Vec3 {
    if (record.type === 'light') return vec3Or(record.position, [0, 0, 0]);
    const t = record.transform;
    if (!Array.isArray(t)) return placementOf(record)!.translate;
    const [x, y, z] = TRANSLATION.map((i) => numberOr(t[i], 0));
    return [x!, y!, z!];
}

/** The field that puts the anchor there. */
export function anchoredAt(record: SceneRecord, anchor: Vec3): { path: string; value: Json } {
    const value = anchor.map(millimetres);
    if (record.type === 'light') return { path: '/position', value };
    const t = record.transform;
    if (isObject(t)) return { path: '/transform/translate', value };
    if (!Array.isArray(t)) return { path: '/transform', value: { translate: value } };
    const matrix = [...t];
    TRANSLATION.forEach((i, axis) => (matrix[i] = value[axis]!));
    return { path: '/transform', value: matrix };
}

const millimetres = (v: number): number => Math.round(v * 1000) / 1000;
