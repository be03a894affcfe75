/** Sun and sky of the scene, in words, and the ops that make them. */
import { newId } from '../lib/ids';
import { numberOr, type Op, type SceneRecord } from '../protocol/types';
import { isOn } from './lights';

/** Hours. */
export const DAY = 24;

export interface Daylight {
    sun: { elevation_deg: number; azimuth_deg: number; illuminance_lx: number; horizontal_lx: number } | null;
    sky: { luminance_cd_m2: number; horizontal_lx: number } | null;
}

/** CIE S 011. */
export const SKIES: [string, string][] = [
    ['1', 'Overcast, steep'],
    ['2', 'Overcast, brighter at the sun'],
    ['3', 'Overcast, moderate'],
    ['4', 'Overcast, moderate, brighter at the sun'],
    ['5', 'Uniform'],
    ['6', 'Partly cloudy, slight glow'],
    ['7', 'Partly cloudy, bright glow'],
    ['8', 'Partly cloudy, distinct corona'],
    ['9', 'Partly cloudy, sun hidden'],
    ['10', 'Partly cloudy, bright at the sun'],
    ['11', 'White-blue, distinct corona'],
    ['12', 'Clear'],
    ['13', 'Clear, polluted'],
    ['14', 'Cloudless, turbid'],
    ['15', 'White-blue, turbid'],
    ['16', 'Overcast, traditional'],
];

export interface DaylightRecords {
    sun?: SceneRecord;
    sky?: SceneRecord;
    /** Environments and further skies that are on and do not shine, since the sky does. */
    replaced: SceneRecord[];
    /** What shines from afar beside the sun: most likely the sun that was there before. */
    doubled: SceneRecord[];
}

/** Of the first of each kind by id, which are those that the server speaks of. */
export function daylightOf(lights: readonly SceneRecord[]): DaylightRecords {
    const of = (kind: string): SceneRecord[] => lights.filter((l) => l.kind === kind).sort((a, b) => (a.id < b.id ? -1 : 1));
    const suns = of('sun');
    const skies = of('sky');
    const shines = suns[0] !== undefined && isOn(suns[0]);
    const shining = shiningSky(lights);
    return {
        sun: suns[0],
        sky: skies[0],
        replaced: [...skies, ...of('environment')].filter((l) => isReplaced(l, shining)),
        doubled: shines ? [...suns.slice(1), ...of('directional')].filter(isOn) : [],
    };
}

/** Of the skies that are on the first by id. */
export function shiningSky(lights: readonly SceneRecord[]): string | null {
    const ids = lights.filter((l) => l.kind === 'sky' && isOn(l)).map((l) => l.id);
    return ids.length > 0 ? ids.reduce((a, b) => (a < b ? a : b)) : null;
}

/** It is on, and the sky shines in its place. */
export const isReplaced = (light: SceneRecord, shining: string | null): boolean =>
    shining !== null && light.id !== shining && (light.kind === 'environment' || light.kind === 'sky') && isOn(light);

export const switchOff = (lights: readonly SceneRecord[]): Op[] => lights.map(({ id }) => ({ op: 'set', id, path: '/on', value: false }));

const isOvercast = (type: number): boolean => type <= 5 || type === 16;

/** How much light the air takes of the sun's, towards the zenith (PROTOCOL.md). */
const CLEAR_AIR = 0.21;
const THIN_CLOUDS = 0.8;
const extinctionOf = (type: number): number => (type <= 10 ? THIN_CLOUDS : CLEAR_AIR);

/** "2026-06-21" where the browser is. */
export function localDate(now: Date): string {
    const two = (n: number): string => String(n).padStart(2, '0');
    return `${now.getFullYear()}-${two(now.getMonth() + 1)}-${two(now.getDate())}`;
}

export function clockOf(hour: number): string {
    const minutes = Math.round(hour * 60);
    return `${String(Math.floor(minutes / 60)).padStart(2, '0')}:${String(minutes % 60).padStart(2, '0')}`;
}

/** Degrees: of the disc that is seen, which gives shadows their soft edges. */
export const SUN_DIAMETER = 0.53;

export const newSun = (taken: (id: string) => boolean, date: string): Op => ({
    op: 'add',
    type: 'light',
    id: newId('sun', taken),
    kind: 'sun',
    latitude_deg: 50,
    longitude_deg: 10,
    date,
    time_h: 10,
    utc_offset_h: 1,
    diameter_deg: SUN_DIAMETER,
});

export const newSky = (taken: (id: string) => boolean): Op => ({ op: 'add', type: 'light', id: newId('sky', taken), kind: 'sky', cie_type: 12 });

/**
 * Another sky; the sun shines as through it, and not at all through clouds that are closed. Whoever switched it off otherwise, or
 * gave it an extinction that no sky has, keeps that. One undo step.
 */
export function skyChange(sky: SceneRecord, sun: SceneRecord | undefined, type: number): Op[] {
    const ops: Op[] = [{ op: 'set', id: sky.id, path: '/cie_type', value: type }];
    if (!sun) return ops;
    const closes = isOvercast(type);
    const had = numberOr(sun.extinction, CLEAR_AIR);
    if (closes !== isOvercast(numberOr(sky.cie_type, 12)) && closes === isOn(sun)) ops.push({ op: 'set', id: sun.id, path: '/on', value: !closes });
    if (!closes && had !== extinctionOf(type) && [CLEAR_AIR, THIN_CLOUDS].includes(had)) ops.push({ op: 'set', id: sun.id, path: '/extinction', value: extinctionOf(type) });
    return ops;
}
