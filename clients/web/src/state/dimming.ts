/** How bright a lamp is against what it can be: in percent, and as DALI counts. Setting either is a new number for the same light. Pure. */
import { isObject } from '../protocol/rpc';
import { numberOr, type IntensityField, type Op, type SceneRecord } from '../protocol/types';
import { common } from './many';
import { fluxOf, intensityOf, kindOf, modelFluxOf, UNITS } from './lights';
import { withField } from './scene';

/** What 100 % is: the light of its file, that of its model, or else what it was before. */
export interface Full {
    of: 'file' | 'model' | 'before';
    field: IntensityField;
    value: number;
}

/** before: the lamp as it was found. null: there is nothing to be a part of. */
export function fullOf(light: SceneRecord, before: SceneRecord): Full | null {
    const file = light.kind === 'ies' && isObject(light.photometry) ? numberOr(light.photometry.flux_lm, 0) : 0;
    if (file > 0) {
        const told = typeof light.flux_lm === 'number';
        return { of: 'file', field: told ? 'flux_lm' : 'multiplier', value: told ? file : 1 };
    }
    const model = modelFluxOf(light);
    if (model !== null) return { of: 'model', field: 'flux_lm', value: model };
    const { field, value, automatic } = intensityOf(before);
    return automatic || value <= 0 ? null : { of: 'before', field, value };
}

/** 1 is full. null: it cannot be told. */
export function levelOf(light: SceneRecord, full: Full): number | null {
    const { field, value } = intensityOf(light);
    if (field === full.field) return value / full.value;
    const all = withField(light, `/${full.field}`, full.value);
    const [now, most] = [fluxOf(light), all && fluxOf(all)];
    return now === null || !most ? null : now / most;
}

/** In the quantity that it has, as long as it is not dark. */
export function atLevel(light: SceneRecord, full: Full, level: number): Op {
    const now = levelOf(light, full);
    const { field, value } = intensityOf(light);
    const [path, most] = now ? [field, value / now] : [full.field, full.value];
    return { op: 'set', id: light.id, path: `/${path}`, value: Number((most * level).toPrecision(6)) };
}

/** The curve of IEC 62386-102: 254 is all of it, 1 a thousandth, and equal steps are equal ratios. */
export const fromDali = (n: number): number => (n < 1 ? 0 : 10 ** ((3 / 253) * (n - 1) - 3));
export const toDali = (level: number): number => (level < 0.0005 ? 0 : Math.min(254, Math.max(1, Math.round(1 + (253 / 3) * (Math.log10(level) + 3)))));

const SURFACES: readonly IntensityField[] = ['flux_lm', 'luminance_cd_m2'];
/** What each kind can be told in. */
const FIELDS: Record<string, readonly IntensityField[]> = {
    point: ['flux_lm', 'intensity_cd'],
    spot: ['flux_lm', 'intensity_cd'],
    ies: ['flux_lm', 'multiplier'],
    quad: SURFACES,
    disc: SURFACES,
    sphere: SURFACES,
    surface: SURFACES,
    environment: ['luminance_cd_m2'],
    directional: ['illuminance_lx'],
    sky: ['luminance_cd_m2', 'illuminance_lx'],
    sun: ['illuminance_lx'],
};

/** What was typed in another unit: for all of the lamps, or, where one of them has no such quantity, null. */
export function inUnit(lights: readonly SceneRecord[], value: number, unit: string, full: (light: SceneRecord) => Full | null): Op[] | null {
    if (!(value >= 0)) return null;
    if (unit === '%' || unit === 'dali') {
        const level = unit === '%' ? value / 100 : fromDali(Math.min(254, value));
        return allAt(lights, level, full);
    }
    const field = (Object.keys(UNITS) as IntensityField[]).find((f) => UNITS[f].symbol === unit);
    if (!field || !lights.every((l) => FIELDS[kindOf(l)]?.includes(field))) return null;
    return lights.map((l) => ({ op: 'set', id: l.id, path: `/${field}`, value }));
}

export function allAt(lights: readonly SceneRecord[], level: number, full: (light: SceneRecord) => Full | null): Op[] {
    return lights.flatMap((l) => {
        const most = full(l);
        return most ? [atLevel(l, most, level)] : [];
    });
}

/** Of all of them; null: they differ. */
export const levelOfAll = (lights: readonly SceneRecord[], full: (light: SceneRecord) => Full | null): number | null =>
    common(lights.map((l) => {
        const most = full(l);
        return most && levelOf(l, most);
    }));
