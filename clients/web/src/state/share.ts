/**
 * A view as the end of an address: where the camera stands and how the picture is shown. Whoever opens it sees the same.
 *
 * An address comes from anybody, so that each field is held to what the protocol takes of it. One that is no good is left out, and
 * named; the rest counts. A token is never in it.
 */
import type { CameraPose } from '../protocol/types';
import { length, sub, type Vec3 } from '../lib/vec';
import { orbitFromPose, poseFromOrbit } from '../view/camera';
import { FORCES, isOfLight, MOST_SOLO, OVERLAYS, PLAIN_FALSE_COLOUR, type FalseColour, type Force, type OverlayName, type ViewSettings } from './view';

/** How a view looks, of what a link can say. */
export type SharedSettings = Pick<ViewSettings, 'method' | 'exposure' | 'toneMap' | 'whiteBalance' | 'effects' | 'overlay' | 'falseColour' | 'solo'>;

export interface SharedView {
    pose: CameraPose | null;
    /** Those that it names. */
    settings: Partial<SharedSettings>;
    /** Why fields of it are not used; a sentence each. */
    refused: readonly string[];
}

/** What this server has. */
export interface Known {
    methods: readonly string[];
    effects: readonly string[];
}

/** Longer ones are not looked at: all fields at their longest, 16 names of lamps among them, take half of it. */
const MOST_BYTES = 4096;
const MARK = 'view=1';
/** As the protocol has them. */
const [MOST_M, MOST_EV, MOST_VALUE] = [1e9, 40, 1e12];
const ID = /^[\w.:/-]{1,64}$/;
const TONE_MAPS = ['agx', 'aces', 'reinhard', 'none'];
/** Metres apart, eye and what it looks at. */
const NEAREST = 1e-6;

/** Seven digits: a tenth of a millimetre in a kilometre. */
const brief = (v: number): string => String(Number(v.toPrecision(7)));
const list = (values: readonly number[]): string => values.map(brief).join(',');

/** The end of an address that shows this. */
export function fragmentOf(pose: CameraPose, settings: SharedSettings): string {
    const { method, exposure, toneMap, whiteBalance, overlay, falseColour, solo } = settings;
    const parts: [string, string | null][] = [
        ['eye', list(pose.position)],
        ['at', list(pose.target)],
        ['up', list(pose.up)],
        ['fov', brief(pose.vfov_deg)],
        ['method', method],
        ['ev', exposure && (exposure.auto ? 'auto' : brief(exposure.ev))],
        ['tone', toneMap],
        ['white', whiteBalance === null ? null : brief(whiteBalance)],
        ['map', overlay === 'none' ? null : overlay],
        ...(isOfLight(overlay) ? colourParts(falseColour) : []),
        ['effects', Object.entries(settings.effects).filter(([, force]) => force !== 'auto').map((pair) => pair.join(':')).join(',') || null],
        ['solo', solo.join(',') || null],
    ];
    return [MARK, ...parts.filter(([, text]) => text !== null).map(([key, text]) => `${key}=${encodeURIComponent(text!).replace(/%2C/g, ',').replace(/%3A/g, ':')}`)].join('&');
}

function colourParts(c: FalseColour): [string, string | null][] {
    const text = (key: keyof FalseColour): string | null => (c[key] === PLAIN_FALSE_COLOUR[key] ? null : String(c[key]));
    return [['scale', text('scale')], ['min', text('min')], ['max', text('max')], ['smooth', text('smooth')], ['lines', text('lines')], ['palette', text('palette')]];
}

/** Is this the end of an address that shows a view? */
export const isShared = (hash: string): boolean => new URLSearchParams(hash.replace(/^#/, '')).has('view');

/** It says what is wanted of a field: for the sentence that refuses it. */
type Reader<T> = { wants: string; read(text: string): T | undefined };

const oneOf = <T extends string>(names: readonly T[]): Reader<T> => ({ wants: names.join(', '), read: (text) => names.find((n) => n === text) });
const within = (lo: number, hi: number): Reader<number> => ({
    wants: `a number from ${lo} to ${hi}`,
    read: (text) => (/^[-+.\de]{1,32}$/i.test(text) && Number(text) >= lo && Number(text) <= hi ? Number(text) : undefined),
});
const metres: Reader<Vec3> = {
    wants: `three numbers from ${-MOST_M} to ${MOST_M}`,
    read: (text) => {
        const values = text.split(',').map(within(-MOST_M, MOST_M).read);
        return values.length === 3 && values.every((v) => v !== undefined) ? (values as unknown as Vec3) : undefined;
    },
};
const yes: Reader<boolean> = { wants: 'true or false', read: (text) => (text === 'true' ? true : text === 'false' ? false : undefined) };
const ev: Reader<{ auto: boolean; ev: number }> = {
    wants: `auto, or a number from ${-MOST_EV} to ${MOST_EV}`,
    read: (text) => {
        const value = within(-MOST_EV, MOST_EV).read(text);
        return text === 'auto' ? { auto: true, ev: 0 } : value === undefined ? undefined : { auto: false, ev: value };
    },
};
const lamps: Reader<string[]> = {
    wants: `ids of at most ${MOST_SOLO} lamps or groups`,
    read: (text) => (text.split(',').every((id) => ID.test(id)) && text.split(',').length <= MOST_SOLO ? text.split(',') : undefined),
};
const forces = (effects: readonly string[]): Reader<Record<string, Force>> => ({
    wants: 'effects of this server, each with off or on, as glossy:off',
    read: (text) => {
        const pairs = text.split(',').map((pair) => pair.split(':'));
        const good = pairs.every(([name, force, more]) => more === undefined && effects.includes(name!) && FORCES.includes(force as Force));
        return good ? (Object.fromEntries(pairs) as Record<string, Force>) : undefined;
    },
});

/** null: it is no such link. */
export function sharedIn(hash: string, known: Known): SharedView | null {
    if (!isShared(hash)) return null;
    if (hash.length > MOST_BYTES) return { pose: null, settings: {}, refused: [`The link is not used: it is longer than ${MOST_BYTES} characters`] };
    const given = new URLSearchParams(hash.replace(/^#/, ''));
    const refused: string[] = [];
    const seen = new Set(['view', 't']);
    const refuse = (key: string, wants: string): undefined => void refused.push(`“${key}” of the link is not used: it has to be ${wants}`);
    const take = <T,>(key: string, { wants, read }: Reader<T>): T | undefined => {
        seen.add(key);
        const texts = given.getAll(key);
        if (texts.length > 1) return refuse(key, 'given once');
        return texts.length === 0 ? undefined : (read(texts[0]!) ?? refuse(key, wants));
    };
    if (given.get('view') !== '1') refuse('view', '1, what this page knows');
    const pose = poseIn(take, refuse);
    const overlay = take('map', oneOf(Object.keys(OVERLAYS) as OverlayName[]));
    const falseColour = colourIn(take, refuse);
    const settings: Partial<SharedSettings> = withoutUndefined({
        method: take('method', oneOf(known.methods)),
        exposure: take('ev', ev),
        toneMap: take('tone', oneOf(TONE_MAPS)),
        whiteBalance: take('white', within(1667, 25000)),
        effects: take('effects', forces(known.effects)),
        overlay,
        falseColour: falseColour ?? undefined,
        solo: take('solo', lamps),
    });
    for (const key of new Set(given.keys())) if (!seen.has(key)) refused.push(`“${key.slice(0, 32)}” of the link is not known`);
    return { pose, settings, refused };
}

type Take = <T>(key: string, reader: Reader<T>) => T | undefined;
type Refuse = (key: string, wants: string) => undefined;

/** A camera needs both ends, and an up that is not along its view. */
function poseIn(take: Take, refuse: Refuse): CameraPose | null {
    const position = take('eye', metres);
    const target = take('at', metres);
    const up = take('up', metres) ?? [0, 1, 0];
    const vfov_deg = take('fov', within(1, 179)) ?? 45;
    if (!position || !target) {
        if (position || target) refuse(position ? 'at' : 'eye', 'given with the other end of the view');
        return null;
    }
    if (length(sub(target, position)) < NEAREST) {
        refuse('at', 'another place than “eye”');
        return null;
    }
    // As the page holds it, with the eye at a distance of its own: what the server refuses would be no picture at all.
    const pose: CameraPose = { position, target, up: length(up) < NEAREST ? [0, 1, 0] : up, vfov_deg };
    const held = poseFromOrbit(orbitFromPose(pose));
    if ([...held.position, ...held.target, ...held.up].every((v) => Math.abs(v) <= MOST_M)) return pose;
    refuse('eye', `so that a view from it stays within ${MOST_M} metres`);
    return null;
}

function colourIn(take: Take, refuse: Refuse): FalseColour | null {
    const told = withoutUndefined({
        scale: take('scale', oneOf(['log', 'linear'] as const)),
        min: take('min', within(0, MOST_VALUE)),
        max: take('max', within(0, MOST_VALUE)),
        smooth: take('smooth', yes),
        lines: take('lines', oneOf(['off', 'on', 'only'] as const)),
        palette: take('palette', oneOf(['even', 'spectrum'] as const)),
    });
    const colour = { ...PLAIN_FALSE_COLOUR, ...told };
    const { min, max, scale } = colour;
    if (min === null && max === 0) {
        refuse('max', 'above 0');
        colour.max = null;
    }
    if ((min !== null && max !== null && min >= max) || (scale === 'log' && min === 0)) {
        refuse('min', scale === 'log' ? 'above 0, and less than “max”' : 'less than “max”');
        Object.assign(colour, { min: null, max: null });
    }
    return Object.keys(told).length > 0 ? colour : null;
}

function withoutUndefined<T extends object>(o: T): { [K in keyof T]?: Exclude<T[K], undefined> } {
    return Object.fromEntries(Object.entries(o).filter(([, v]) => v !== undefined)) as { [K in keyof T]?: Exclude<T[K], undefined> };
}

/** The address of a view of the scene that this page shows: its project, and nothing else that its own address has. */
export function linkTo(base: { origin: string; pathname: string }, project: string, fragment: string): string {
    const query = project === '' ? '' : `?project=${encodeURIComponent(project)}`;
    return `${base.origin}${base.pathname}${query}#${fragment}`;
}
