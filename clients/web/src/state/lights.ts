/** What the light list needs to know about a lamp: a light record, or an object that shines. */
import { cctToLinear } from '../lib/colour';
import { cross, length, type Vec3 } from '../lib/vec';
import { isObject, type JsonObject } from '../protocol/rpc';
import { INTENSITY_FIELDS, numberOr, stringOr, vec3Or, type IntensityField, type Op, type SceneRecord } from '../protocol/types';
import { anchorOf } from './placement';

export interface Unit {
    symbol: string;
    spoken: string;
    /** Range of the slider; the number itself may go beyond. */
    min: number;
    max: number;
}

export const UNITS: Record<IntensityField, Unit> = {
    flux_lm: { symbol: 'lm', spoken: 'lumens', min: 1, max: 100_000 },
    intensity_cd: { symbol: 'cd', spoken: 'candela', min: 1, max: 100_000 },
    luminance_cd_m2: { symbol: 'cd/m²', spoken: 'candela per square metre', min: 1, max: 1_000_000 },
    illuminance_lx: { symbol: 'lx', spoken: 'lux', min: 0.1, max: 150_000 },
    multiplier: { symbol: '×', spoken: 'times its file', min: 0.01, max: 4 },
};

export interface Intensity {
    field: IntensityField;
    value: number;
    unit: Unit;
    /** It is as bright as clear air makes it; value says nothing. */
    automatic: boolean;
}

/** Which place, date and time make as bright as they are, unless they are told an amount. */
export const isDaylight = (light: SceneRecord): boolean => light.kind === 'sky' || light.kind === 'sun';

/** What a slider sets of a light that says no amount of its own. */
function defaultField(kind: string): IntensityField {
    if (kind === 'ies') return 'multiplier';
    return kind === 'sky' || kind === 'sun' ? 'illuminance_lx' : 'flux_lm';
}

export function intensityOf(light: SceneRecord): Intensity {
    const told = INTENSITY_FIELDS.find((f) => typeof light[f] === 'number');
    const automatic = told === undefined && isDaylight(light);
    const measured = light.kind === 'ies'; // as bright as its file says, unless it is told otherwise
    const field = told ?? defaultField(stringOr(light.kind, ''));
    const unit = UNITS[field];
    const value = numberOr(light[field] ?? emitsOf(light)?.[field], measured ? 1 : 0);
    return { field, value, automatic, unit: { ...unit, min: value > 0 ? Math.min(unit.min, value) : unit.min, max: Math.max(unit.max, value) } };
}

/** Lumens that leave it when it is on; null where there are none to tell: a sun, a sky. */
export function fluxOf(light: SceneRecord): number | null {
    const { field, value } = intensityOf(light);
    if (field === 'flux_lm') return value;
    const emits = emitsOf(light);
    if (emits) return numberOr(emits.flux_lm, 0);
    const r2 = numberOr(light.radius, 0.1) ** 2;
    switch (light.kind) {
        case 'point':
            return 4 * Math.PI * value;
        case 'ies':
            return isObject(light.photometry) ? numberOr(light.photometry.flux_lm, 0) * value : null;
        case 'spot':
            return spotSolidAngle(light) * value;
        case 'quad':
            return Math.PI * length(cross(vec3Or(light.u, [1, 0, 0]), vec3Or(light.v, [0, 0, 1]))) * value;
        case 'disc':
            return Math.PI ** 2 * r2 * value;
        case 'sphere':
            return 4 * Math.PI ** 2 * r2 * value;
        default:
            return null;
    }
}

/** Integral of glTF's falloff between the cones (KHR_lights_punctual), sr. */
function spotSolidAngle(light: SceneRecord): number {
    const sine = (degrees: number): number => Math.sin((degrees * Math.PI) / 360);
    const inner = sine(numberOr(light.inner_cone_deg, 0));
    const outer = sine(numberOr(light.outer_cone_deg, 45));
    return (4 * Math.PI * (2 * inner ** 2 + outer ** 2)) / 3;
}

/** Lumens of an object by its material alone: what it has in the model. Null: a light, or it shines by its own fields alone. */
export function modelFluxOf(light: SceneRecord): number | null {
    const flux = numberOr(emitsOf(light)?.material_flux_lm, 0);
    return flux > 0 ? flux : null;
}

export function colourOf(light: SceneRecord): { kelvin: number | null; linear: Vec3 } {
    if (typeof light.cct_k === 'number') return { kelvin: light.cct_k, linear: cctToLinear(light.cct_k) };
    return { kelvin: null, linear: vec3Or(light.color ?? emitsOf(light)?.color, [1, 1, 1]) };
}

/** The temperature of the light of all lamps that are on and have one: reciprocal kelvins, by lumens. Null: none has. */
export function kelvinOfAll(lights: readonly SceneRecord[]): number | null {
    let lumens = 0, reciprocal = 0;
    for (const light of lights) {
        const { kelvin } = colourOf(light);
        const flux = isOn(light) ? (fluxOf(light) ?? 0) : 0;
        if (kelvin === null || flux <= 0) continue;
        lumens += flux;
        reciprocal += flux / kelvin;
    }
    return lumens > 0 ? Math.round(lumens / reciprocal) : null;
}

/** How far eyes adapt to the colour of the light around them: CIE 159:2004 (CIECAM02), its degree of adaptation in an average
 * surround, where white walls are 100 cd/m², as 300 to 500 lx make them, and all that is seen is a fifth of that: 0.86. */
const ADAPTED = 1 - Math.exp(-(20 + 42) / 92) / 3.6;
/** White of a screen. */
const SCREEN_K = 6504;
const DAYLIGHT = ['environment', 'directional', 'sky', 'sun'];

/** What is white to whoever comes into the room: most of the way, in reciprocal kelvins, from a screen's white to that of the
 * lamps. Null: as it is on a screen, where daylight comes in, or most of the light has no temperature. */
export function adaptedKelvin(lamps: readonly SceneRecord[]): number | null {
    const lit = lamps.filter(isOn);
    const lumens = (of: readonly SceneRecord[]): number => of.reduce((sum, lamp) => sum + (fluxOf(lamp) ?? 0), 0);
    const kelvin = kelvinOfAll(lit);
    const most = 2 * lumens(lit.filter((lamp) => colourOf(lamp).kelvin !== null)) > lumens(lit);
    if (kelvin === null || !most || lit.some((lamp) => DAYLIGHT.includes(kindOf(lamp)))) return null;
    return Math.round(1 / (ADAPTED / kelvin + (1 - ADAPTED) / SCREEN_K));
}

/** The light of an object that shines, as the server tells it: without it the record is no lamp, or a light. */
export function emitsOf(record: SceneRecord): JsonObject | null {
    return record.type === 'object' && isObject(record.emits) ? record.emits : null;
}

export const isLamp = (record: SceneRecord | undefined): boolean =>
    record !== undefined && (record.type === 'light' || emitsOf(record) !== null);

/** The op that gives an object that shines the light of its material again. */
export const asInModel = (id: string): Op => ({
    op: 'set',
    id,
    path: '',
    value: { flux_lm: null, luminance_cd_m2: null, color: null, cct_k: null },
});

/** The same for how bright it is alone. */
export const dimmedAsInModel = (id: string): Op => ({ op: 'set', id, path: '', value: { flux_lm: null, luminance_cd_m2: null } });

/** True when its own fields say otherwise than its material. */
export const isAdjusted = (light: SceneRecord): boolean =>
    emitsOf(light) !== null && ['flux_lm', 'luminance_cd_m2', 'color', 'cct_k'].some((f) => (light[f] ?? null) !== null);

/** What stands in the list: without the import's name, which all of a model have. */
export const nameOf = (light: SceneRecord): string => {
    const origin = stringOr(light.origin, '');
    return origin && light.id.startsWith(`${origin}/`) ? light.id.slice(origin.length + 1) : light.id;
};

/** Where it is marked: an object is seldom where its anchor is. */
export const centreOf = (light: SceneRecord): Vec3 => vec3Or(emitsOf(light)?.centre, anchorOf(light));

/** It is on, and no picture shows it: it has no extent. */
export function isUnseen(light: SceneRecord | undefined): boolean {
    if (!light || !isOn(light)) return false;
    return light.kind === 'point' || light.kind === 'spot' || (light.kind === 'directional' && numberOr(light.diameter_deg, 0) === 0);
}

export const isOn = (light: SceneRecord): boolean => light.on !== false;

export const isPlaced = (light: SceneRecord): boolean => !['directional', 'environment', 'sky', 'sun'].includes(stringOr(light.kind, ''));

/** Radius of a ball around the lamp itself, in metres, so that the view can frame it. */
export function extentOf(light: SceneRecord): number {
    const edges = [...vec3Or(light.u, [0, 0, 0]), ...vec3Or(light.v, [0, 0, 0])];
    const side = Math.sqrt(numberOr(emitsOf(light)?.area_m2, 0));
    return Math.max(numberOr(light.radius, 0), Math.hypot(...edges) / 2, side, 0.25);
}

export const kindOf = (light: SceneRecord): string => (emitsOf(light) ? 'surface' : stringOr(light.kind, 'light'));

/** True when every word is a part of its id, its group or its kind. */
export function matches(light: SceneRecord, words: readonly string[]): boolean {
    const text = `${light.id} ${stringOr(light.group, '')} ${kindOf(light)}`.toLowerCase();
    return words.every((word) => text.includes(word));
}
