/** What is under a place of the picture. */
import type { JsonObject } from '../protocol/rpc';
import { numberOr, vec3Or, type Pick } from '../protocol/types';

export interface Picked {
    viewId: number | null;
    /** Pixels. */
    size: readonly [number, number];
}

/** x, y: fractions of the picture; outside of it is nothing. */
export async function pickAt(call: (method: string, params: JsonObject) => Promise<JsonObject>, { viewId, size: [w, h] }: Picked, x: number, y: number): Promise<Pick | null> {
    if (viewId === null || !(x >= 0 && x < 1 && y >= 0 && y < 1)) return null;
    const hit = await call('pick', { view_id: viewId, x: x * w, y: y * h });
    if (typeof hit.id !== 'string') return null;
    return { id: hit.id, point: vec3Or(hit.point, [0, 0, 0]), normal: vec3Or(hit.normal, [0, 1, 0]), distance: numberOr(hit.distance, 0) };
}
