/** Light meters that belong to the scene: what the server says of them, while somebody looks. */
import { effect, signal } from '@preact/signals';
import { newId } from '../lib/ids';
import { isObject, type Json, type JsonObject } from '../protocol/rpc';
import { add, scale, sub, type Vec3 } from '../lib/vec';
import { numberOr, stringOr, vec3Or, type CameraPose, type Op, type SceneRecord } from '../protocol/types';
import type { Edits } from './edits';
import type { SceneMirror } from './scene';

export interface Value {
    value: number;
    stderr: number;
}
export interface Target {
    target: number;
    passes: boolean;
    /** More than two standard errors lie between. */
    sure: boolean;
}
/** What the lamps that are on take, by their files. */
export interface Power {
    watts: number;
    floorM2: number;
    perM2: number;
    per100Lx: number | null;
    lamps: number;
    /** Of them, those whose files do not say. */
    unknown: number;
    /** Some of those, for people. */
    names: string[];
}
export interface SensorReading {
    kind: string;
    /** Of the scene that it is of. */
    rev: number;
    settled: boolean;
    points: number;
    leftOut: number;
    /** Points along u, and rows of them. */
    nu: number;
    nv: number;
    /** What its points tell; of an observer ''. */
    quantity: string;
    /** Of each point, row by row, lx or UGR; null: left out, not known, nothing glares, or all but the lamps is dark. Empty: they were not asked for. */
    values: (number | null)[];
    em: Value | null;
    emin: Value | null;
    uo: Value | null;
    /** Mean cylindrical over mean illuminance; null: not asked for, or not known. */
    modelling: Value | null;
    /** It is what EN 12464-1 recommends. */
    modellingInRange: boolean;
    ugr: Value | null;
    /** Of eyes: where, and looking which way, one is glared most; null: not known. */
    worst: { point: Vec3; direction: Vec3 } | null;
    /** Lines of sight of each. */
    directions: number;
    /** Null: not known yet. */
    dgp: Value | null;
    /** How people are glared by day: "imperceptible" and so on. */
    dgpBand: string;
    /** There is as much light at the eye as the formula of DGP is made for. */
    dgpInRange: boolean;
    /** Of the room's work plane, where a lamp is on and a file says what one takes; else null. */
    power: Power | null;
    targets: Partial<Record<'em' | 'uo' | 'ugr' | 'dgp', Target>>;
}

/** Of people who sit (EN 12464-1). */
const EYE_HEIGHT_M = 1.2;
const EYE_DIRECTIONS = 8;

/** The server measures within the time of frames, and no sensor at all while nobody asks. */
export interface SensorsHost {
    scene: SceneMirror;
    edits: Edits;
    /** Of the view. */
    pose(): CameraPose;
    call(method: string, params: JsonObject): Promise<JsonObject>;
    onError(error: Error): void;
}

export class Sensors {
    readonly readings = signal<ReadonlyMap<string, SensorReading>>(new Map());
    /** Their points are drawn in the picture. */
    readonly pointsShown = signal(true);
    private readonly connected = signal(false);
    private watched: 'nothing' | 'means' | 'points' = 'nothing';

    constructor(private readonly host: SensorsHost) {
        effect(() => {
            const some = host.scene.list('sensor').value.length > 0;
            const wanted = !some ? 'nothing' : this.pointsShown.value ? 'points' : 'means';
            if (this.connected.value && wanted !== this.watched) void this.watch(wanted);
        });
    }

    /** The scene is known. A new connection knows nothing of what the last one asked for. */
    begin(): void {
        this.watched = 'nothing';
        this.connected.value = true;
    }

    closed(): void {
        this.connected.value = false;
        this.readings.value = new Map();
    }

    notified(params: JsonObject): void {
        const now = new Map(this.readings.peek());
        for (const sensor of Array.isArray(params.sensors) ? params.sensors.filter(isObject) : [])
            now.set(stringOr(sensor.id, ''), readingOf(sensor));
        this.readings.value = now;
    }

    /** A work plane over the whole floor, with the targets of office work. */
    async addWorkPlane(): Promise<void> {
        const { scene, edits, call, onError } = this.host;
        try {
            const placed = await call('sensor.place', {});
            const id = newId('work-plane', (taken) => scene.peek(taken) !== undefined);
            const op: Op = { op: 'add', type: 'sensor', id, ...placed, target_lx: 500, target_uo: 0.6 };
            await edits.transaction([op]);
        } catch (error) {
            onError(error as Error);
        }
    }

    /** Eyes all over the floor, as those who sit there have them, each looking all around; with the target of offices. */
    async addEyes(): Promise<void> {
        const { scene, edits, call, onError } = this.host;
        try {
            const placed = await call('sensor.place', { height_m: EYE_HEIGHT_M, directions: EYE_DIRECTIONS });
            delete placed.floor_m2; // of power, which is told of a work plane
            const id = newId('glare', (taken) => scene.peek(taken) !== undefined);
            await edits.transaction([{ op: 'add', type: 'sensor', id, ...placed, quantity: 'ugr', directions: EYE_DIRECTIONS, target_ugr: 19 }]);
        } catch (error) {
            onError(error as Error);
        }
    }

    /** Eyes want no lux, and other points no UGR: such targets go with what they were of. */
    measure(record: SceneRecord, quantity: string): void {
        const set = (path: string, value: Json): Op => ({ op: 'set', id: record.id, path, value });
        const gone = (quantity === 'ugr' ? ['target_lx', 'target_uo'] : ['target_ugr']).filter((name) => (record[name] ?? null) !== null);
        void this.host.edits.transaction([...gone.map((name) => set(`/${name}`, null)), set('/quantity', quantity)]);
    }

    /** Who looks as the view does: an eye where its camera is. */
    async addObserver(): Promise<void> {
        const { scene, edits, pose, onError } = this.host;
        const { position, target } = pose();
        const id = newId('observer', (taken) => scene.peek(taken) !== undefined);
        try {
            const direction = sub(target, position);
            await edits.transaction([{ op: 'add', type: 'sensor', id, kind: 'observer', position: [...position], direction: [...direction], target_ugr: 19 }]);
        } catch (error) {
            onError(error as Error);
        }
    }

    remove(id: string): void {
        void this.host.edits.transaction([{ op: 'remove', id }]);
    }

    /** All points that count, and the glare of observers, as a file of comma separated values: that of `lumend measure --csv`. */
    async csv(): Promise<string> {
        const lines = ['sensor,quantity,x_m,y_m,z_m,value,stderr'];
        for (const id of this.host.scene.list('sensor').peek()) {
            const told = await this.host.call('sensor.read', { id });
            const add = (quantity: string, at: Json | undefined, value: Json | undefined, error: Json | undefined): void => {
                if (typeof value === 'number') lines.push([id, quantity, ...(Array.isArray(at) ? at.map(Number) : []), value, numberOr(error, NaN)].join(','));
            };
            if (told.kind === 'observer') for (const name of ['ugr', 'dgp']) add(name, this.host.scene.peek(id)?.position, told[name], told[`${name}_stderr`]);
            const points = Array.isArray(told.points) ? told.points.filter(isObject) : [];
            const quantity = stringOr(told.quantity, '');
            for (const p of points) add('ugr', p.point, p.ugr, p.ugr_stderr);
            for (const p of points) add(quantity === 'modelling' ? 'plane' : quantity, p.point, p.lx, p.stderr_lx);
            for (const p of points) add('cylindrical', p.point, p.ez_lx, p.ez_stderr_lx);
        }
        return `${lines.join('\n')}\n`;
    }

    private async watch(what: 'nothing' | 'means' | 'points'): Promise<void> {
        this.watched = what;
        try {
            await this.host.call('sensor.watch', what === 'points' ? { on: true, points: true } : { on: what === 'means' });
        } catch (error) {
            this.host.onError(error as Error);
        }
    }
}

function valueOf(sensor: JsonObject, name: string, error: string): Value | null {
    const value = sensor[name];
    return typeof value === 'number' ? { value, stderr: numberOr(sensor[error], NaN) } : null;
}

function powerOf(told: Json | undefined): Power | null {
    if (!isObject(told) || numberOr(told.lamps, 0) === 0 || typeof told.w_per_m2 !== 'number') return null;
    return {
        watts: numberOr(told.watts, 0),
        floorM2: numberOr(told.floor_m2, 0),
        perM2: told.w_per_m2,
        per100Lx: typeof told.w_per_m2_100_lx === 'number' ? told.w_per_m2_100_lx : null,
        lamps: numberOr(told.lamps, 0),
        unknown: numberOr(told.lamps_without_watts, 0),
        names: (Array.isArray(told.without_watts) ? told.without_watts.filter(isObject) : []).map((of) => `${stringOr(of.what, '')} (${stringOr(of.id, '')}${numberOr(of.n, 1) > 1 ? ' and others' : ''})`),
    };
}

/** "Without 2 of 12 lamps, whose power is not known: quad (panel-a), disc (spot)"; null: all say. */
export function unknownInWords({ lamps, unknown, names }: Power): string | null {
    if (unknown === 0) return null;
    const which = names.length > 0 ? `: ${names.join(', ')}` : '';
    return `Without ${unknown} of ${lamps} lamps, whose power is not known${which}`;
}

export function readingOf(sensor: JsonObject): SensorReading {
    const quantity = stringOr(sensor.quantity, '');
    const values = quantity === 'ugr' ? sensor.point_ugr : sensor.lx;
    const targets: SensorReading['targets'] = {};
    const told = isObject(sensor.targets) ? sensor.targets : {};
    for (const name of ['em', 'uo', 'ugr', 'dgp'] as const) {
        const t: Json | undefined = told[name];
        if (isObject(t)) targets[name] = { target: numberOr(t.target, NaN), passes: t.passes === true, sure: t.sure === true };
    }
    return {
        kind: stringOr(sensor.kind, ''),
        rev: numberOr(sensor.scene_rev, 0),
        settled: sensor.settled === true,
        points: numberOr(sensor.nu, 1) * numberOr(sensor.nv, 1),
        leftOut: numberOr(sensor.left_out, 0),
        nu: numberOr(sensor.nu, 1),
        nv: numberOr(sensor.nv, 1),
        quantity,
        values: Array.isArray(values) ? values.map((v) => (typeof v === 'number' ? v : null)) : [],
        em: valueOf(sensor, 'em_lx', 'em_stderr_lx'),
        emin: valueOf(sensor, 'emin_lx', 'emin_stderr_lx'),
        uo: valueOf(sensor, 'uo', 'uo_stderr'),
        power: powerOf(sensor.power),
        modelling: valueOf(sensor, 'modelling', 'modelling_stderr'),
        modellingInRange: sensor.modelling_in_range === true,
        ugr: valueOf(sensor, 'ugr', 'ugr_stderr'),
        worst: Array.isArray(sensor.worst_point) ? { point: vec3Or(sensor.worst_point, [0, 0, 0]), direction: vec3Or(sensor.worst_direction, [0, 0, -1]) } : null,
        directions: numberOr(sensor.directions, 1),
        dgp: valueOf(sensor, 'dgp', 'dgp_stderr'),
        dgpBand: stringOr(sensor.dgp_band, ''),
        dgpInRange: sensor.dgp_in_range !== false,
        targets,
    };
}

/** How far it is known; of a single point nothing more than that. */
export function stateOf(reading: SensorReading | undefined, current: boolean): string {
    if (!reading) return 'not measured yet';
    const { points, leftOut } = reading;
    const words = points > 1 ? [`${points - leftOut} points`, ...(leftOut > 0 ? [`${leftOut} left out`] : [])] : leftOut > 0 ? ['inside something, or right below it'] : [];
    if (!current) words.push('before the last change');
    return words.join(', ') + (current && !reading.settled ? ' …' : '');
}

/** In words, for who sees no colours and who sees nothing: "meets 500", "misses 500, as far as is known". */
export function verdict(t: Target): string {
    return `${t.passes ? 'meets' : 'misses'} ${t.target}${t.sure ? '' : ', as far as is known'}`;
}

/** "Worst of 3 observers: UGR 21.3 (desk-2), DGP 0.38 (desk-1)"; null: there are not two that are known. */
export function worstInWords(readings: ReadonlyMap<string, SensorReading>, ids: readonly string[], nameOf: (id: string) => string): string | null {
    const observers = ids.filter((id) => readings.get(id)?.kind === 'observer' || readings.get(id)?.quantity === 'ugr');
    if (observers.length < 2) return null;
    const worst = (name: 'ugr' | 'dgp', digits: number): string[] => {
        const known = observers.map((id) => ({ id, value: readings.get(id)![name]?.value ?? -Infinity })).sort((a, b) => b.value - a.value);
        return Number.isFinite(known[0]!.value) ? [`${name.toUpperCase()} ${known[0]!.value.toFixed(digits)} (${nameOf(known[0]!.id)})`] : [];
    };
    const of = [...worst('ugr', 1), ...worst('dgp', 2)];
    return of.length > 0 ? `Worst of ${observers.length} observers: ${of.join(', ')}` : null;
}

/** What a sensor may measure at its points, in the words of designers. */
export const QUANTITIES: [string, string][] = [
    ['plane', 'Illuminance of the plane'],
    ['cylindrical', 'Cylindrical illuminance'],
    ['semicylindrical', 'Semicylindrical illuminance'],
    ['modelling', 'Plane and cylindrical: modelling'],
    ['ugr', 'Glare of eyes there: UGR'],
];

/** "Modelling within 0.30 to 0.60 (EN 12464-1)". */
export function modellingInWords({ modellingInRange }: Pick<SensorReading, 'modellingInRange'>): string {
    return `Modelling is ${modellingInRange ? 'within' : 'not within'} 0.30 to 0.60, which EN 12464-1 recommends`;
}

/** "Worst at x 0.98, y 1.2, z -1.06 m, looking along 0, 0, -1; of 8 lines of sight at each place". */
export function worstPlaceInWords({ worst, directions }: Pick<SensorReading, 'worst' | 'directions'>): string | null {
    if (!worst) return null;
    const short = (v: number): string => String(Number(v.toFixed(2)) + 0);
    const [x, y, z] = worst.point.map(short);
    return `Worst at x ${x}, y ${y}, z ${z} m, looking along ${worst.direction.map(short).join(', ')}; of ${directions} lines of sight at each place`;
}

/** What that eye sees: of somebody who looks straight ahead. */
export function gazeOf({ point, direction }: { point: Vec3; direction: Vec3 }): CameraPose {
    return { position: point, target: add(point, direction), up: [0, 1, 0], vfov_deg: 60 };
}

/** What glare by day feels like. */
export function daylightInWords({ dgpBand, dgpInRange }: Pick<SensorReading, 'dgpBand' | 'dgpInRange'>): string {
    return `Glare by day: ${dgpBand}${dgpInRange ? '' : '; DGP is made for more than 380 lx at the eye'}`;
}

/** Where point number i lies: in the middles of equal cells, row by row along u. */
export function pointAt(record: SceneRecord, { nu, nv }: Pick<SensorReading, 'nu' | 'nv'>, i: number): Vec3 {
    const along = (edge: Json | undefined, part: number): Vec3 => scale(vec3Or(edge, [0, 0, 0]), part);
    const u = record.kind === 'line' || record.kind === 'grid' ? ((i % nu) + 0.5) / nu - 0.5 : 0;
    const v = record.kind === 'grid' ? (Math.floor(i / nu) + 0.5) / nv - 0.5 : 0;
    return add(vec3Or(record.position, [0, 0, 0]), add(along(record.u, u), along(record.v, v)));
}

/** Of places in the picture those that are `w` to the side of each other, or `h` above, in pixels: the nearest to the bottom come first. */
export function apart(places: readonly ({ x: number; y: number } | null)[], w: number, h: number): Set<number> {
    const taken = new Map<string, { x: number; y: number }[]>();
    const chosen = new Set<number>();
    const order = places.map((_, i) => i).filter((i) => places[i]).sort((a, b) => places[b]!.y - places[a]!.y);
    for (const i of order) {
        const at = places[i]!;
        const [cx, cy] = [Math.floor(at.x / w), Math.floor(at.y / h)];
        const near = [-1, 0, 1].flatMap((dx) => [-1, 0, 1].flatMap((dy) => taken.get(`${cx + dx} ${cy + dy}`) ?? []));
        if (near.some((p) => Math.abs(p.x - at.x) < w && Math.abs(p.y - at.y) < h)) continue;
        chosen.add(i);
        taken.set(`${cx} ${cy}`, [...(taken.get(`${cx} ${cy}`) ?? []), at]);
    }
    return chosen;
}

/** met: as much as the mean is to be. missed: less than the least may be. near: between. plain: nothing is asked. */
export type PointVerdict = 'met' | 'near' | 'missed' | 'plain';

export function judge(value: number, record: SceneRecord): PointVerdict {
    if (record.quantity === 'ugr') return !(numberOr(record.target_ugr, 0) > 0) ? 'plain' : value <= numberOr(record.target_ugr, 0) ? 'met' : 'missed';
    const wanted = numberOr(record.target_lx, 0);
    if (!(wanted > 0)) return 'plain';
    if (value >= wanted) return 'met';
    return value < wanted * numberOr(record.target_uo, 1) ? 'missed' : 'near';
}

/** "9 of 12 points reach 500 lx, 1 is below 300"; null: nothing is asked, or not known. */
export function pointsInWords(record: SceneRecord, { values }: Pick<SensorReading, 'values'>): string | null {
    const wanted = numberOr(record.target_lx, 0);
    const known = values.filter((v) => v !== null);
    const most = numberOr(record.target_ugr, 0);
    if (record.quantity === 'ugr' && most > 0 && known.length > 1) return `${known.filter((v) => judge(v, record) === 'met').length} of ${known.length} places that are glared have at most UGR ${most}`;
    if (known.length < 2 || !(wanted > 0)) return null;
    const n = (verdict: PointVerdict): number => known.filter((v) => judge(v, record) === verdict).length;
    const least = wanted * numberOr(record.target_uo, 1);
    const missed = n('missed');
    const below = missed > 0 && least < wanted ? `, ${missed} ${missed === 1 ? 'is' : 'are'} below ${Number(least.toPrecision(3))}` : '';
    return `${n('met')} of ${known.length} points reach ${wanted} lx${below}`;
}
