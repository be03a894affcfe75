/** What the status line shows: rates and latencies as this client measures them, and the server's numbers of the last frame. */
import { signal } from '@preact/signals';
import { History, RateWindow } from '../lib/window';
import type { FrameHeader } from '../protocol/frame';
import { Flag } from '../protocol/frame';
import { isObject, type JsonObject } from '../protocol/rpc';
import { numberOr, stringOr } from '../protocol/types';

const HISTORY = 120;
const WINDOW_MS = 1500;

export interface FrameNumbers {
    frameSeq: number;
    sceneRev: number;
    spp: number;
    error: number | null;
    converged: boolean;
    /** A first, coarse picture: not every pixel has a sample. */
    rough: boolean;
    serverMs: number;
    width: number;
    height: number;
}

export interface Effect {
    name: string;
    on: boolean;
    /** What calls for it, or why nothing does. */
    why: string;
    /** False: the method leaves it out. */
    served: boolean;
    tiles: number;
    rays: number;
    ms: number;
    /** Of its light in the picture's samples, over the mean luminance of all; null: not known. */
    noise: number | null;
}

/** Records of the cache that all views share, and what the frame did with them. */
export interface CacheNumbers {
    records: number;
    created: number;
    updated: number;
    reused: number;
    removed: number;
}

/** Light that mirrors and solid glass send where no method shows it. */
export interface Missing {
    /** How much of which lamp's, in words. */
    why: string;
    /** What can be done about it. */
    mend: string;
}

/** Why a picture may be empty. */
export type InView = 'scene' | 'dark' | 'nothing';

/** What a frame took to render. A frame that shows the same samples again took nothing, and leaves these as they were. */
export interface Work {
    ms: number;
    raysPerSecond: number;
    effects: Effect[];
    /** null: the method keeps none. */
    cache: CacheNumbers | null;
}

/** How far the picture is off: root mean square error of luminance by mean luminance. */
export interface ErrorNumbers {
    /** An estimate. */
    rel: number;
    /** At most, with 95 % confidence. */
    bound: number;
    /** 0 to 1: how much of it was measured in this picture, and not in those before. */
    fresh: number;
}

/** What the colours of a map stand for. */
export interface OverlayLegend {
    unit: string;
    /** CSS colours, from the least class to the greatest. */
    colors: string[];
    /** Between each two; of a smooth scale, round values on it. */
    limits: number[];
    /** Of maps of light. */
    scale: Scale | null;
    /** Where the values of lines are written. */
    labels: Label[];
}

export interface Scale {
    kind: 'log' | 'linear';
    smooth: boolean;
    min: number;
    max: number;
}

/** In pixels of the frame. */
export interface Label {
    x: number;
    y: number;
    value: number;
}

export interface ServerNumbers extends Work {
    /** null: not known. */
    error: ErrorNumbers | null;
    /** null: nothing, or too little to tell. */
    missing: Missing | null;
    inView: InView;
    /** Of the map over the picture; null: there is none. */
    legend: OverlayLegend | null;
    /** What rendered the frame; "" when the server did not say. */
    method: string;
    /** What "automatic" exposure currently is; null: the server did not say. */
    exposureEv: number | null;
    /** How the frame came: "jpeg 85". WebP and PNG of 100 are exact. null: the server did not say. */
    coding: string | null;
    /** Bits a second that the line brings here, as the server reckons it; null: not known. */
    lineBits: number | null;
}

export class FrameMeter {
    readonly frame = signal<FrameNumbers | null>(null);
    readonly server = signal<ServerNumbers | null>(null);
    readonly fps = signal(0);
    readonly kbits = signal(0);
    readonly roundTripMs = signal<number | null>(null);
    readonly latencyMs = signal<number | null>(null);
    /** Grows with every entry of the two histories; they are drawn when it changes. */
    readonly ticks = signal(0);
    readonly frameHistory = new History(HISTORY);
    readonly latencyHistory = new History(HISTORY);
    private readonly frames = new RateWindow(WINDOW_MS);
    private readonly bytes = new RateWindow(WINDOW_MS);

    received(bytes: number): void {
        this.bytes.push(performance.now(), bytes);
    }

    drawn(h: FrameHeader): void {
        this.frames.push(performance.now(), 1);
        this.frame.value = {
            frameSeq: h.frameSeq,
            sceneRev: h.sceneRev,
            spp: h.spp,
            error: h.error,
            converged: (h.flags & Flag.converged) !== 0,
            rough: h.downscale > 0 || h.spp === 0,
            serverMs: h.serverUs / 1000,
            width: h.fullW,
            height: h.fullH,
        };
    }

    /** From the user's hand to the picture that shows it. */
    latency(ms: number): void {
        this.latencyMs.value = ms;
        this.latencyHistory.push(ms);
        this.ticks.value++;
    }

    /** frame.stats */
    stats(params: JsonObject): void {
        const rendered = params.passes !== 0;
        const before = this.server.peek();
        const work = rendered || !before ? workOf(params) : before;
        this.server.value = {
            ms: work.ms,
            raysPerSecond: work.raysPerSecond,
            effects: work.effects,
            cache: work.cache,
            error: isObject(params.error) ? errorOf(params.error) : null,
            missing: isObject(params.caustics) ? missingOf(params.caustics) : null,
            inView: params.in_view === 'dark' || params.in_view === 'nothing' ? params.in_view : 'scene',
            legend: isObject(params.overlay) ? legendOf(params.overlay) : null,
            method: stringOr(params.method, ''),
            exposureEv: typeof params.exposure_ev === 'number' ? params.exposure_ev : null,
            coding: typeof params.codec === 'string' ? `${params.codec} ${numberOr(params.quality, 0)}` : null,
            lineBits: typeof params.line_bytes_s === 'number' ? 8 * params.line_bytes_s : null,
        };
        if (!rendered) return;
        this.frameHistory.push(work.ms);
        this.ticks.value++;
    }

    /** Call twice a second or so: rates fall to zero when nothing arrives. */
    tick(): void {
        const now = performance.now();
        this.fps.value = this.frames.rate(now);
        this.kbits.value = (8 * this.bytes.rate(now)) / 1000;
    }
}

function workOf(params: JsonObject): Work {
    const ms = numberOr(params.ms, 0);
    const rays = isObject(params.rays) ? sum(params.rays) : 0;
    return {
        ms,
        raysPerSecond: ms > 0 ? (1000 * rays) / ms : 0,
        effects: isObject(params.effects) ? effectsOf(params.effects) : [],
        cache: isObject(params.cache) && sum(params.cache) > 0 ? cacheOf(params.cache) : null,
    };
}

function cacheOf(cache: JsonObject): CacheNumbers {
    return {
        records: numberOr(cache.records, 0),
        created: numberOr(cache.created, 0),
        updated: numberOr(cache.updated, 0),
        reused: numberOr(cache.reused, 0),
        removed: numberOr(cache.removed, 0),
    };
}

export function legendOf(o: JsonObject): OverlayLegend | null {
    const colors = list(o.colors).filter((c): c is string => typeof c === 'string' && /^#[0-9a-f]{6}$/.test(c));
    const limits = list(o.limits).filter((l): l is number => typeof l === 'number');
    const scale = scaleOf(o);
    if (scale?.smooth ? colors.length < 2 : colors.length !== limits.length + 1) return null;
    return { unit: stringOr(o.unit, ''), colors, limits, scale, labels: list(o.labels).flatMap(labelOf) };
}

function scaleOf(o: JsonObject): Scale | null {
    if (o.scale !== 'log' && o.scale !== 'linear') return null;
    return { kind: o.scale, smooth: o.smooth === true, min: numberOr(o.min, 0), max: numberOr(o.max, 1) };
}

function labelOf(label: unknown): Label[] {
    const [x, y, value] = list(label);
    return typeof x === 'number' && typeof y === 'number' && typeof value === 'number' ? [{ x, y, value }] : [];
}

/** Where a value is on a scale: 0 at its least, 1 at its greatest. */
export function placeOn({ kind, min, max }: Scale, value: number): number {
    const at = kind === 'log' ? Math.log(value / min) / Math.log(max / min) : (value - min) / (max - min);
    return Math.min(1, Math.max(0, at));
}

function list(value: unknown): unknown[] {
    return Array.isArray(value) ? value : [];
}

export function errorOf(error: JsonObject): ErrorNumbers {
    return { rel: numberOr(error.rel, 0), bound: numberOr(error.bound, 0), fresh: numberOr(error.fresh, 1) };
}

function missingOf(caustics: JsonObject): Missing | null {
    const why = stringOr(caustics.why, '');
    return why ? { why, mend: stringOr(caustics.mend, '') } : null;
}

function sum(counters: JsonObject): number {
    let total = 0;
    for (const v of Object.values(counters)) total += numberOr(v, 0);
    return total;
}

/** Of what all effects take of time, and leave of noise: that adds up by its squares. null: not known. */
export interface Shares {
    time: number;
    noise: number | null;
}

export function sharesOf(effects: readonly Effect[]): Map<string, Shares> {
    const part = (of: number, all: number): number => (all > 0 ? of / all : 0);
    const ms = effects.reduce((all, e) => all + e.ms, 0);
    const squares = effects.reduce((all, e) => all + (e.noise ?? 0) ** 2, 0);
    const shares = (e: Effect): Shares => ({ time: part(e.ms, ms), noise: e.noise === null ? null : part(e.noise ** 2, squares) });
    return new Map(effects.map((e) => [e.name, shares(e)]));
}

function effectsOf(effects: JsonObject): Effect[] {
    const list: Effect[] = [];
    for (const [name, e] of Object.entries(effects)) {
        if (!isObject(e)) continue;
        list.push({
            name,
            on: e.on === true,
            why: stringOr(e.why, ''),
            served: e.served !== false,
            tiles: numberOr(e.tiles, 0),
            rays: numberOr(e.rays, 0),
            ms: numberOr(e.ns, 0) / 1e6,
            noise: typeof e.noise === 'number' ? e.noise : null,
        });
    }
    return list;
}
