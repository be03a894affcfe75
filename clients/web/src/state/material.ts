/** What a material's record means to who plans light: how much it reflects and lets through, and which of its parts are in use. */
import { luminance } from '../lib/colour';
import type { Vec3 } from '../lib/vec';
import type { JsonObject } from '../protocol/rpc';
import { numberOr, vec3Or, type SceneRecord } from '../protocol/types';

type Fields = Readonly<JsonObject>;

const WHITE: Vec3 = [1, 1, 1];
const BLACK: Vec3 = [0, 0, 0];

/** What fields are where a record does not say; protocol/PROTOCOL.md. */
const DEFAULTS: Readonly<Record<string, number>> = { roughness: 1, ior: 1.5, specular: 1 };
const COLOURS: Readonly<Record<string, Vec3>> = { base_color: WHITE, specular_color: WHITE, attenuation_color: WHITE, emission_color: WHITE };

export const amountOf = (m: Fields, field: string): number => numberOr(m[field], DEFAULTS[field] ?? 0);
export const colourOf = (m: Fields, field: string): Vec3 => vec3Or(m[field], COLOURS[field] ?? BLACK);

/** Of a facet's single reflection without Fresnel: what of light that comes at 8 degrees leaves again, and of even light. By
 * roughness 0, 0.1 … 1; the renderer's own table (GGX, height-correlated Smith). */
const AT_8_DEGREES = [1, 1, 0.998, 0.9905, 0.9667, 0.9112, 0.8183, 0.6927, 0.5541, 0.4236, 0.3088];
const ON_AVERAGE = [1, 0.9996, 0.9947, 0.9766, 0.9399, 0.8799, 0.7999, 0.7045, 0.6022, 0.5022, 0.4091];

function between(table: readonly number[], roughness: number): number {
    const at = Math.min(1, Math.max(0, roughness)) * (table.length - 1);
    const i = Math.min(table.length - 2, Math.floor(at));
    return table[i]! + (table[i + 1]! - table[i]!) * (at - i);
}

interface Facets {
    once: number;
    average: number;
}

/** Along a stretch facets lean farther: as of a roughness that spreads about as much. */
function facetsOf(m: Fields): Facets {
    const across = amountOf(m, 'roughness') ** 2;
    const along = across + (1 - across) * amountOf(m, 'anisotropy') ** 2;
    const roughness = Math.sqrt(Math.sqrt((across ** 2 + along ** 2) / 2));
    return { once: between(AT_8_DEGREES, roughness), average: between(ON_AVERAGE, roughness) };
}

/** What an interface reflects at 8 degrees, light that met several facets included (Kulla & Conty 2017; 1 / 21: mean of Schlick's). */
function interfaceReflects(f0: number, f90: number, { once, average }: Facets): number {
    const mean = f0 + (f90 - f0) / 21;
    return f0 * once + ((1 - once) * mean ** 2 * average) / (1 - mean * (1 - average));
}

/** Reflectance of the face of what is no metal, at a right angle. */
function faceOf(m: Fields): Vec3 {
    const ior = Math.max(1, amountOf(m, 'ior'));
    const r = ((ior - 1) / (ior + 1)) ** 2;
    return colourOf(m, 'specular_color').map((c) => Math.min(1, r * c) * amountOf(m, 'specular')) as unknown as Vec3;
}

/** A thin pane of two faces that reflect r, and what is left of light that crosses it once. */
function pane(r: number, left: number): { up: number; down: number } {
    const down = ((1 - r) ** 2 * left) / Math.max(1e-9, 1 - (r * left) ** 2);
    return { up: r * (1 + down * left), down };
}

const LACQUER = 0.04;

export interface Light {
    /** Luminous reflectance and transmittance for light near the normal, gloss included, as spectrophotometers measure (8°/d). */
    rho: number;
    tau: number;
    /** Solid glass: what it lets through depends on how thick it is. */
    solid: boolean;
}

/** By the numbers of the record alone: textures multiply them, fuzz is left out. */
export function lightOf(m: Fields, base: Vec3 = colourOf(m, 'base_color')): Light {
    if (m.unlit === true) return { rho: 0, tau: 0, solid: false };
    const metal = amountOf(m, 'metallic');
    const glass = (1 - metal) * amountOf(m, 'transmission');
    const coated = 1 - metal - glass;
    const facets = facetsOf(m);
    const face = faceOf(m);
    const f90 = amountOf(m, 'specular');
    const far = colourOf(m, 'diffuse_transmittance');
    const thin = m.thin === true;
    const enters = 1 - interfaceReflects(Math.max(...face), f90, facets);
    const up = (k: 0 | 1 | 2): number =>
        metal * interfaceReflects(base[k], 1, facets) +
        coated * (interfaceReflects(face[k], f90, facets) + enters * base[k]) +
        glass * (thin ? pane(face[k], base[k]).up : face[k]);
    const down = (k: 0 | 1 | 2): number => coated * enters * far[k] + (thin ? glass * pane(face[k], base[k]).down : 0);
    const lacquer = LACQUER * amountOf(m, 'clearcoat');
    const rho = lacquer + (1 - lacquer) * luminance([up(0), up(1), up(2)]);
    return { rho, tau: (1 - lacquer) * luminance([down(0), down(1), down(2)]), solid: glass > 0 && !thin };
}

/** Never more than v, or two shares would be more than the whole; 1e-9: what floats make of four digits. */
const digits = (v: number): number => Math.floor(v * 1e4 + 1e-9) / 1e4;
const rounded = (c: Vec3): Vec3 => [digits(c[0]), digits(c[1]), digits(c[2])];

/** At most what is left of 1 in each channel: a sheet's two shares are of one whole. */
export function within(c: Vec3, other: Vec3): Vec3 {
    return rounded([0, 1, 2].map((k) => Math.min(1 - other[k as 0 | 1 | 2], Math.max(0, c[k as 0 | 1 | 2]))) as unknown as Vec3);
}

/** The colour of this hue with which m reflects rho, or comes nearest to it: brighter than white is nothing. */
export function baseFor(m: Fields, rho: number, hue: Vec3 = colourOf(m, 'base_color')): Vec3 {
    const of = luminance(hue) > 0 ? hue : WHITE;
    const free = colourOf(m, 'diffuse_transmittance').map((t) => 1 - t);
    const most = Math.min(...free.map((f, k) => (of[k]! > 0 ? f / of[k]! : Infinity)));
    let low = 0, high = most;
    for (let i = 0; i < 40; i++) {
        const middle = (low + high) / 2;
        if (lightOf(m, [of[0] * middle, of[1] * middle, of[2] * middle]).rho < rho) low = middle;
        else high = middle;
    }
    return rounded([of[0] * high, of[1] * high, of[2] * high]);
}

/** The same of what a sheet lets through evenly. */
export function sheetFor(m: Fields, tau: number): Vec3 {
    const now = colourOf(m, 'diffuse_transmittance');
    const of = luminance(now) > 0 ? now : WHITE;
    const enters = lightOf({ ...m, diffuse_transmittance: [1, 1, 1], transmission: 0, thin: false }).tau;
    const wanted = enters > 0 ? tau / enters / luminance(of) : 0;
    const free = colourOf(m, 'base_color').map((c) => 1 - c);
    const most = Math.min(...free.map((f, k) => (of[k]! > 0 ? f / of[k]! : Infinity)));
    const s = Math.max(0, Math.min(wanted, most));
    return rounded([of[0] * s, of[1] * s, of[2] * s]);
}

/** Haze as data sheets have it (ASTM D1003, ISO 14782): of light along the normal that passes, what leaves by more than this. */
const HAZE_ANGLE = (2.5 * Math.PI) / 180;
/** Below this the renderer has facets in a plane. */
const SMOOTH_ALPHA = 1e-3;

/** Facets of a thin pane (GGX) that lean by more than half the angle send light out of the cone. */
function facetHaze(roughness: number): number {
    const alpha = roughness ** 2;
    return alpha < SMOOTH_ALPHA ? 0 : alpha ** 2 / (alpha ** 2 + Math.tan(HAZE_ANGLE / 2) ** 2);
}

/** Of a thin pane. What passes evenly, where it is a sheet in part, is haze but for its share within the cone. */
export function hazeOf(m: Fields): number {
    const all = lightOf(m).tau;
    const glass = lightOf({ ...m, diffuse_transmittance: [...BLACK] }).tau;
    const even = (all - glass) * Math.cos(HAZE_ANGLE) ** 2;
    return all > 0 ? (glass * facetHaze(amountOf(m, 'roughness')) + even) / all : 0;
}

/** The roughness with which it has so much haze, or comes nearest to it; five digits are a hundredth of a percent. */
export function roughnessFor(m: Fields, haze: number): number {
    let low = 0, high = 1;
    for (let i = 0; i < 40; i++) {
        const middle = (low + high) / 2;
        if (hazeOf({ ...m, roughness: middle }) < haze) low = middle;
        else high = middle;
    }
    return Math.round(1e5 * high) / 1e5;
}

/** True where roughness alone says how hazy it is. */
export const hasHaze = (m: Fields): boolean => m.thin === true && isUsed(m, 'glass') && !isUsed(m, 'brushed') && amountOf(m, 'ior') > 1 && lightOf(m).tau > 0;

/** Parts of a material that most have not. */
export const PARTS = ['lacquer', 'brushed', 'glass', 'sheet', 'cloth', 'glow'] as const;
export type Part = (typeof PARTS)[number];

const SAYS: Record<Part, string> = {
    lacquer: 'clearcoat',
    brushed: 'anisotropy',
    glass: 'transmission',
    sheet: 'diffuse_transmittance',
    cloth: 'sheen_color',
    glow: 'emission_cd_m2',
};

export function isUsed(m: Fields, part: Part): boolean {
    const value = m[SAYS[part]];
    return Array.isArray(value) ? value.some((v) => typeof v === 'number' && v > 0) : numberOr(value, 0) > 0;
}

/** Pictures that multiply or bend what the numbers say. */
export function mapsOf(m: SceneRecord): string[] {
    const names: [string, string][] = [
        ['base_color_texture', 'colour'],
        ['metallic_roughness_texture', 'roughness and metal'],
        ['normal_texture', 'relief'],
        ['specular_texture', 'gloss'],
        ['specular_color_texture', 'the colour of gloss'],
        ['transmission_texture', 'glass'],
        ['diffuse_transmission_texture', 'transmittance'],
        ['clearcoat_texture', 'lacquer'],
        ['clearcoat_roughness_texture', 'its roughness'],
        ['clearcoat_normal_texture', 'its relief'],
        ['anisotropy_texture', 'brushing'],
        ['emission_texture', 'light'],
    ];
    return names.filter(([field]) => (m[field] ?? null) !== null).map(([, name]) => name);
}
