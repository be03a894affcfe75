/** Lamps that are mixed together: those that name the same group. */
import type { Json } from '../protocol/rpc';
import { stringOr, type IntensityField, type SceneRecord } from '../protocol/types';
import { fluxOf, intensityOf, modelFluxOf, UNITS, type Unit } from './lights';

export interface Grouping {
    /** In no group, or the only one of it. */
    alone: string[];
    /** Name and members of those that have several. */
    groups: [string, string[]][];
}

export function grouped(ids: readonly string[], record: (id: string) => SceneRecord | undefined): Grouping {
    const groups = new Map<string, string[]>();
    const groupOf = (id: string): string => stringOr(record(id)?.group, '');
    for (const id of ids) if (groupOf(id)) groups.set(groupOf(id), [...(groups.get(groupOf(id)) ?? []), id]);
    const several = [...groups].filter(([, members]) => members.length > 1);
    const inGroup = new Set(several.flatMap(([, members]) => members));
    return { alone: ids.filter((id) => !inGroup.has(id)), groups: several };
}

/** Those that give most light first, switched on or not; then by name. Where none is known it counts as none. */
export function byLight(groups: Grouping['groups'], lumens: (id: string) => number): Grouping['groups'] {
    const totals = new Map(groups.map(([name, ids]) => [name, ids.reduce((sum, id) => sum + lumens(id), 0)]));
    return [...groups].sort(([a], [b]) => totals.get(b)! - totals.get(a)! || (a < b ? -1 : 1));
}

/** What the dimmer of a group shows: the light of all; where not all have a flux, the largest number in the unit of the first. */
export function groupIntensity(lights: readonly SceneRecord[]): { value: number; model: number | null; unit: Unit; total: boolean } {
    const sum = (values: readonly (number | null)[]): number | null =>
        values.reduce<number | null>((all, v) => (all === null || v === null ? null : all + v), 0);
    const flux = sum(lights.map(fluxOf));
    if (flux !== null) {
        const unit = { ...UNITS.flux_lm, max: UNITS.flux_lm.max * lights.length };
        return { value: flux, model: sum(lights.map(modelFluxOf)), unit: reaching(unit, flux), total: true };
    }
    const { field } = intensityOf(lights[0]!);
    const value = Math.max(...lights.map(intensityOf).map((i) => (i.field === field ? i.value : 0)));
    return { value, model: null, unit: reaching(UNITS[field], value), total: false };
}

const reaching = (unit: Unit, value: number): Unit => ({
    ...unit,
    min: value > 0 ? Math.min(unit.min, value) : unit.min,
    max: Math.max(unit.max, value),
});

/** Where a gesture of a group's dimmer began: its steps are scaled from here, so that rounding does not add up. */
export interface GroupStart {
    value: number;
    lamps: { id: string; field: IntensityField; value: number }[];
}

export function groupStart(lights: readonly SceneRecord[]): GroupStart {
    const lamps = lights.map((l) => ({ id: l.id, field: intensityOf(l).field, value: intensityOf(l).value }));
    return { value: groupIntensity(lights).value, lamps };
}

/** Fields that take the group to `value` (above 0) with the ratios as they were; from dark all become alike. */
export function scaledTo(start: GroupStart, value: number): { id: string; path: string; value: Json }[] {
    const scaled = (v: number): number => Number((v * (value / start.value)).toPrecision(6));
    const alike = value / start.lamps.length;
    return start.lamps.map((l) => ({ id: l.id, path: `/${l.field}`, value: start.value > 0 ? scaled(l.value) : alike }));
}
