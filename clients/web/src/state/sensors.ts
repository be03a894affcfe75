/** Light meters that belong to the scene: what the server says of them, while somebody looks. */
import { effect, signal } from '@preact/signals';
import { isObject, type Json, type JsonObject } from '../protocol/rpc';
import { numberOr, stringOr, type Op } from '../protocol/types';
import type { Edits } from './edits';
import { newId } from './imports';
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
export interface SensorReading {
    kind: string;
    /** Of the scene that it is of. */
    rev: number;
    settled: boolean;
    points: number;
    leftOut: number;
    em: Value | null;
    emin: Value | null;
    uo: Value | null;
    ugr: Value | null;
    targets: Partial<Record<'em' | 'uo' | 'ugr', Target>>;
}

/** The server measures within the time of frames, and no sensor at all while nobody asks. */
export interface SensorsHost {
    scene: SceneMirror;
    edits: Edits;
    call(method: string, params: JsonObject): Promise<JsonObject>;
    onError(error: Error): void;
}

export class Sensors {
    readonly readings = signal<ReadonlyMap<string, SensorReading>>(new Map());
    private readonly connected = signal(false);
    private watched = false;

    constructor(private readonly host: SensorsHost) {
        effect(() => {
            const wanted = host.scene.list('sensor').value.length > 0;
            if (this.connected.value && wanted !== this.watched) void this.watch(wanted);
        });
    }

    /** The scene is known. A new connection knows nothing of what the last one asked for. */
    begin(): void {
        this.watched = false;
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

    remove(id: string): void {
        void this.host.edits.transaction([{ op: 'remove', id }]);
    }

    /** All points that count, and the UGR of observers, as a file of comma separated values: that of `lumend measure --csv`. */
    async csv(): Promise<string> {
        const lines = ['sensor,quantity,x_m,y_m,z_m,value,stderr'];
        for (const id of this.host.scene.list('sensor').peek()) {
            const told = await this.host.call('sensor.read', { id });
            const add = (quantity: string, at: unknown, value: unknown, error: Json | undefined): void => {
                if (typeof value === 'number') lines.push([id, quantity, ...(Array.isArray(at) ? at : []), value, numberOr(error, NaN)].join(','));
            };
            add('ugr', this.host.scene.peek(id)?.position, told.ugr, told.ugr_stderr);
            for (const p of Array.isArray(told.points) ? told.points.filter(isObject) : [])
                add(stringOr(told.quantity, ''), p.point, p.lx, p.stderr_lx);
        }
        return `${lines.join('\n')}\n`;
    }

    private async watch(on: boolean): Promise<void> {
        this.watched = on;
        try {
            await this.host.call('sensor.watch', { on });
        } catch (error) {
            this.host.onError(error as Error);
        }
    }
}

function valueOf(sensor: JsonObject, name: string, error: string): Value | null {
    const value = sensor[name];
    return typeof value === 'number' ? { value, stderr: numberOr(sensor[error], NaN) } : null;
}

export function readingOf(sensor: JsonObject): SensorReading {
    const targets: SensorReading['targets'] = {};
    const told = isObject(sensor.targets) ? sensor.targets : {};
    for (const name of ['em', 'uo', 'ugr'] as const) {
        const t: Json | undefined = told[name];
        if (isObject(t)) targets[name] = { target: numberOr(t.target, NaN), passes: t.passes === true, sure: t.sure === true };
    }
    return {
        kind: stringOr(sensor.kind, ''),
        rev: numberOr(sensor.scene_rev, 0),
        settled: sensor.settled === true,
        points: numberOr(sensor.nu, 1) * numberOr(sensor.nv, 1),
        leftOut: numberOr(sensor.left_out, 0),
        em: valueOf(sensor, 'em_lx', 'em_stderr_lx'),
        emin: valueOf(sensor, 'emin_lx', 'emin_stderr_lx'),
        uo: valueOf(sensor, 'uo', 'uo_stderr'),
        ugr: valueOf(sensor, 'ugr', 'ugr_stderr'),
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
