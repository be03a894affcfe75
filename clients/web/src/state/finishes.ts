/** Finishes that rooms are planned with, by the reflectances that data sheets and tables give them. Pure. */
import type { Vec3 } from '../lib/vec';
import type { Json, JsonObject } from '../protocol/rpc';
import { baseFor, lightOf, sheetFor } from './material';

export interface Finish {
    name: string;
    kind: 'Paint' | 'Floor' | 'Wood and stone' | 'Metal' | 'Glass' | 'Lets light through';
    /** Luminous, gloss included. Of glass it follows from its faces. */
    rho?: number;
    /** Of what goes through. */
    tau?: number;
    /** Linear; how bright it is follows from rho. */
    hue?: Vec3;
    fields?: JsonObject;
}

const MATT: JsonObject = { specular: 0, roughness: 1 };
const SATIN: JsonObject = { roughness: 0.5 };
const PANE: JsonObject = { transmission: 1, thin: true, roughness: 0 };
const metal = (roughness: number, anisotropy = 0): JsonObject => ({ metallic: 1, roughness, anisotropy });

/** Usual values. Where the maker's sheet has another one the slider takes it. */
export const FINISHES: readonly Finish[] = [
    { kind: 'Paint', name: 'White paint', rho: 0.85, fields: MATT },
    { kind: 'Paint', name: 'Off-white paint', rho: 0.75, hue: [1, 0.97, 0.9], fields: MATT },
    { kind: 'Paint', name: 'Satin white paint', rho: 0.8, fields: SATIN },
    { kind: 'Paint', name: 'Light grey paint', rho: 0.5, fields: MATT },
    { kind: 'Paint', name: 'Dark grey paint', rho: 0.15, fields: MATT },
    { kind: 'Paint', name: 'Black paint', rho: 0.05, fields: MATT },
    { kind: 'Paint', name: 'Acoustic ceiling tile', rho: 0.85, hue: [1, 1, 0.98], fields: MATT },
    { kind: 'Floor', name: 'Grey carpet', rho: 0.2, fields: MATT },
    { kind: 'Floor', name: 'Dark carpet', rho: 0.08, fields: MATT },
    { kind: 'Floor', name: 'Light linoleum', rho: 0.35, hue: [1, 0.93, 0.8], fields: { roughness: 0.45 } },
    { kind: 'Floor', name: 'White tiles', rho: 0.75, fields: { roughness: 0.1 } },
    { kind: 'Wood and stone', name: 'Light wood (maple)', rho: 0.5, hue: [1, 0.76, 0.5], fields: { roughness: 0.5 } },
    { kind: 'Wood and stone', name: 'Wood (oak)', rho: 0.35, hue: [1, 0.68, 0.38], fields: { roughness: 0.5 } },
    { kind: 'Wood and stone', name: 'Dark wood (walnut)', rho: 0.12, hue: [1, 0.55, 0.3], fields: { roughness: 0.5 } },
    { kind: 'Wood and stone', name: 'Lacquered wood', rho: 0.35, hue: [1, 0.68, 0.38], fields: { roughness: 0.5, clearcoat: 1, clearcoat_roughness: 0.1 } },
    { kind: 'Wood and stone', name: 'Concrete', rho: 0.3, hue: [1, 0.97, 0.92], fields: { roughness: 0.9, specular: 0.5 } },
    { kind: 'Wood and stone', name: 'Red brick', rho: 0.2, hue: [1, 0.38, 0.24], fields: MATT },
    { kind: 'Metal', name: 'Brushed aluminium', rho: 0.7, hue: [0.98, 0.99, 1], fields: metal(0.3, 0.6) },
    { kind: 'Metal', name: 'Polished aluminium', rho: 0.85, hue: [0.98, 0.99, 1], fields: metal(0.05) },
    { kind: 'Metal', name: 'Anodised aluminium, matt', rho: 0.65, hue: [0.98, 0.99, 1], fields: metal(0.5) },
    { kind: 'Metal', name: 'Brushed stainless steel', rho: 0.55, hue: [1, 0.97, 0.92], fields: metal(0.35, 0.7) },
    { kind: 'Metal', name: 'Chrome', rho: 0.65, hue: [0.97, 0.99, 1], fields: metal(0.02) },
    { kind: 'Metal', name: 'Brass', rho: 0.6, hue: [1, 0.8, 0.4], fields: metal(0.2) },
    { kind: 'Glass', name: 'Clear glass', tau: 0.9, fields: PANE },
    { kind: 'Glass', name: 'Double glazing', tau: 0.8, hue: [0.97, 1, 0.98], fields: PANE },
    { kind: 'Glass', name: 'Grey glass', tau: 0.45, fields: PANE },
    { kind: 'Glass', name: 'Satin glass', tau: 0.85, fields: { ...PANE, roughness: 0.5 } },
    { kind: 'Lets light through', name: 'Opal cover', rho: 0.35, tau: 0.55, fields: { roughness: 0.3, specular: 0 } },
    { kind: 'Lets light through', name: 'Lampshade', rho: 0.55, tau: 0.35, hue: [1, 0.95, 0.84], fields: MATT },
    { kind: 'Lets light through', name: 'Sheer curtain', rho: 0.35, tau: 0.6, fields: MATT },
    { kind: 'Lets light through', name: 'Sunscreen fabric', rho: 0.45, tau: 0.1, fields: MATT },
];

/** A surface of no particular kind, without pictures. Its light, if it has any, is not a matter of its finish. */
const PLAIN: JsonObject = {
    ...{ base_color_texture: null, metallic_roughness_texture: null, normal_texture: null, anisotropy_texture: null },
    ...{ specular_texture: null, specular_color_texture: null, transmission_texture: null, diffuse_transmission_texture: null },
    ...{ clearcoat_texture: null, clearcoat_roughness_texture: null, clearcoat_normal_texture: null, diffuse_transmission_share: 0 },
    ...{ metallic: 0, roughness: 1, ior: 1.5, specular: 1, specular_color: [1, 1, 1] },
    ...{ transmission: 0, diffuse_transmittance: [0, 0, 0], thin: false, attenuation_color: [1, 1, 1], attenuation_distance: null },
    ...{ sheen_color: [0, 0, 0], sheen_roughness: 0, clearcoat: 0, clearcoat_roughness: 0, anisotropy: 0, anisotropy_rotation_deg: 0 },
    ...{ alpha_mode: 'opaque', alpha: 1, unlit: false },
};

/** All fields of a surface that has it. */
export function fieldsOf({ rho, tau, hue = [1, 1, 1], fields }: Finish): JsonObject {
    const m: JsonObject = { ...PLAIN, ...fields };
    if (m.transmission === 1) return { ...m, base_color: [...tintFor(m, tau ?? 1, hue)] };
    if (tau !== undefined) m.diffuse_transmittance = [...sheetFor({ ...m, base_color: [0, 0, 0] }, tau)];
    return { ...m, base_color: [...baseFor(m, rho ?? 0, hue)] };
}

/** Of a pane that lets tau through. */
function tintFor(m: JsonObject, tau: number, hue: Vec3): Vec3 {
    const most = 1 / Math.max(...hue);
    let low = 0, high = most;
    for (let i = 0; i < 40; i++) {
        const s = (low + high) / 2;
        if (lightOf(m, [hue[0] * s, hue[1] * s, hue[2] * s]).tau < tau) low = s;
        else high = s;
    }
    return hue.map((h) => Math.round(h * high * 1e4) / 1e4) as unknown as Vec3;
}

/** As people read it: "ρ 85 %", "τ 90 %". */
export function inWords({ rho, tau }: Finish): string {
    const share = (name: string, v: number | undefined): string[] => (v === undefined ? [] : [`${name} ${Math.round(100 * v)} %`]);
    return [...share('ρ', rho), ...share('τ', tau)].join(', ');
}

const close = (a: Json | undefined, b: Json | undefined): boolean => {
    if (typeof a === 'number' && typeof b === 'number') return Math.abs(a - b) < 1e-6;
    if (Array.isArray(a) && Array.isArray(b)) return a.length === b.length && a.every((v, i) => close(v, b[i]));
    return (a ?? null) === (b ?? null);
};

const KNOWN: readonly (readonly [Finish, [string, Json | undefined][]])[] = FINISHES.map((f) => [f, Object.entries(fieldsOf(f))]);

/** The one that the record has; null: none of these. */
export function finishOf(m: Readonly<JsonObject>): Finish | null {
    const whole: JsonObject = { ...PLAIN, base_color: [1, 1, 1], ...m };
    return KNOWN.find(([, fields]) => fields.every(([key, v]) => close(whole[key], v)))?.[0] ?? null;
}
