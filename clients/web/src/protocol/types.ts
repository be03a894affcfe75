/** What the messages carry, as far as this client reads it. Units are in the names; protocol/PROTOCOL.md is normative. */
import type { Json, JsonObject } from './rpc';
import type { Vec3 } from '../lib/vec';

/** A scene record as scene.get{expand:true} gives it: the fields of its "add" op. */
export interface SceneRecord extends JsonObject {
    type: string;
    id: string;
}

export type Op =
    | { op: 'add'; type: string; id: string; [field: string]: Json | undefined }
    | { op: 'set'; id: string; path: string; value: Json }
    | { op: 'remove'; id: string }
    | { op: 'import'; id: string; asset: string };

export interface CameraPose {
    position: Vec3;
    target: Vec3;
    up: Vec3;
    vfov_deg: number;
}

export const INTENSITY_FIELDS = ['flux_lm', 'intensity_cd', 'luminance_cd_m2', 'illuminance_lx', 'multiplier'] as const;
export type IntensityField = (typeof INTENSITY_FIELDS)[number];

export interface Pick {
    id: string;
    point: Vec3;
    normal: Vec3;
    distance: number;
}

export function numberOr(value: Json | undefined, fallback: number): number {
    return typeof value === 'number' && Number.isFinite(value) ? value : fallback;
}

export function stringOr(value: Json | undefined, fallback: string): string {
    return typeof value === 'string' ? value : fallback;
}

export function vec3Or(value: Json | undefined, fallback: Vec3): Vec3 {
    if (!Array.isArray(value) || value.length !== 3 || !value.every((v) => typeof v === 'number')) return fallback;
    return value as unknown as Vec3;
}
