/** A lighting desk: which of its channels control what, and what the server hears of it. */
import { signal } from '@preact/signals';
import { newId } from '../lib/ids';
import { Once } from '../lib/once';
import { isObject, type Json, type JsonObject } from '../protocol/rpc';
import { numberOr, stringOr, type Op, type SceneRecord } from '../protocol/types';
import type { Edits } from './edits';
import type { SceneMirror } from './scene';

export interface Universe {
    protocol: string;
    number: number;
    late: number;
    lost: number;
    sources: { name: string; priority: number; rateHz: number }[];
}
export interface DeskStatus {
    sacn: number | null;
    artnet: number | null;
    dropped: number;
    universes: Universe[];
}

export const CHANNELS: [string, string][] = [
    ['dim', 'Dimmer'],
    ['dim16', 'Dimmer, 16 bit'],
    ['rgb', 'RGB'],
    ['rgb16', 'RGB, 16 bit'],
];
const WIDTH: Record<string, number> = { dim: 1, dim16: 2, rgb: 3, rgb16: 6 };
export const LAST_CHANNEL = 512;

export const widthOf = (patch: SceneRecord): number => WIDTH[stringOr(patch.channels, 'dim')] ?? 1;

/** null: the server listens to no desk. */
export function deskOf(stats: JsonObject): DeskStatus | null {
    const desk = stats.desk;
    if (!isObject(desk)) return null;
    const port = (ear: Json | undefined): number | null => (isObject(ear) ? numberOr(ear.port, 0) : null);
    const dropped = (ear: Json | undefined): number => (isObject(ear) ? numberOr(ear.dropped, 0) : 0);
    const listed = (list: Json | undefined): JsonObject[] => (Array.isArray(list) ? list.filter(isObject) : []);
    return {
        sacn: port(desk.sacn),
        artnet: port(desk.artnet),
        dropped: dropped(desk.sacn) + dropped(desk.artnet),
        universes: listed(desk.universes).map((u) => ({
            protocol: stringOr(u.protocol, ''),
            number: numberOr(u.universe, 0),
            late: numberOr(u.late, 0),
            lost: numberOr(u.lost, 0),
            sources: listed(u.sources).map((s) => ({ name: stringOr(s.name, ''), priority: numberOr(s.priority, 0), rateHz: numberOr(s.rate_hz, 0) })),
        })),
    };
}

/** "desk.py at 44 Hz, priority 100", of each source; what is gone holds its last look. */
export function inWords(u: Universe): string {
    const sources = u.sources.map((s) => `${s.name || 'unnamed'} at ${Math.round(s.rateHz)} Hz${u.protocol === 'sacn' ? `, priority ${s.priority}` : ''}`);
    const faults = [u.late > 0 ? `${u.late} late` : '', u.lost > 0 ? `${u.lost} lost` : ''].filter((text) => text !== '');
    return [sources.join(' and ') || 'silent: the last look holds', ...faults].join(', ');
}

/** After the channels that are taken in this universe, or 1 where nothing is free there. */
export function nextAddress(patches: readonly SceneRecord[], universe: number): number {
    const ends = patches.filter((p) => numberOr(p.universe, 1) === universe).map((p) => numberOr(p.address, 1) + widthOf(p));
    const next = Math.max(1, ...ends);
    return next <= LAST_CHANNEL ? next : 1;
}

export interface DeskHost {
    scene: SceneMirror;
    edits: Edits;
    call(method: string, params: JsonObject): Promise<JsonObject>;
}

export class Desk {
    readonly status = signal<DeskStatus | null>(null);
    private readonly asking = new Once(async () => {
        this.status.value = deskOf(await this.host.call('stats.get', {}));
    });

    constructor(private readonly host: DeskHost) {}

    /** Asked again while somebody looks; what goes wrong shows elsewhere. */
    ask(): void {
        this.asking.run().catch(() => {});
    }

    /** A dimmer for it, on the next free channel of universe 1. */
    add(target: string): void {
        const { scene, edits } = this.host;
        const patches = scene.list('patch').peek().map((id) => scene.peek(id)).filter((p) => p !== undefined);
        const op: Op = {
            ...{ op: 'add', type: 'patch', id: newId('patch', (taken) => scene.peek(taken) !== undefined) },
            ...{ target, universe: 1, address: nextAddress(patches, 1) },
        };
        void edits.transaction([op]);
    }

    remove(id: string): void {
        void this.host.edits.transaction([{ op: 'remove', id }]);
    }
}
