/** How the error of the picture falls while it is refined, and what that says of the time ahead. */
import { computed, signal } from '@preact/signals';
import { duration, number, percent } from '../lib/format';
import { isObject, type Json, type JsonObject } from '../protocol/rpc';
import { numberOr, stringOr } from '../protocol/types';
import { errorOf, type ErrorNumbers } from './frame_meter';
import { STOPS, type Stop } from './view';

/** An error of which less than this was measured in the picture itself is one of the pictures before. */
export const FRESH = 0.5;
/** What is more than this says how few pixels were compared so far, and not how far they are off: a path or two that were ten times
 * too bright weigh more than all the others. */
export const LOOSE = 0.5;
/** Points nearer in time than this ratio are one. */
const SAME_TIME = 1.02;
/** The fit is over the points of the last such ratio of time: what comes is like what was of late. */
const RECENT = 8;
/** It needs that many points, over that ratio of time at least. */
const FIT_POINTS = 4;
const FIT_SPAN = 2;
/** Longer than this nobody waits. */
const LONGEST_S = 86400;
/** Samples too few to tell how long the others take. */
const FEW_SAMPLES = 4;

export interface Point {
    /** Seconds of work since the picture began; those in which it rested do not count. */
    s: number;
    /** Relative errors: at most, with 95 % confidence, and estimated. */
    bound: number;
    rel: number;
}

/** What is known of one picture, from its first frame to its newest. */
export interface Course {
    s: number;
    spp: number;
    /** Of whole pictures only, and where the error is their own. */
    points: readonly Point[];
    /** stopped_by of frame.stats; "" while it goes on. */
    stopped: string;
    /** What the server expects of the error that it was asked for; null: nothing, or another end before. */
    expected: Expected | null;
}

/** Seconds that are left; `most` null: perhaps never. */
export interface Expected {
    s: number;
    least: number;
    most: number | null;
}

/** The line through the logarithms: error = at1s * s^slope. */
export interface Fit {
    slope: number;
    at1s: number;
}

/** When a picture has an error: `s` seconds after it began. */
export type Outlook = { is: 'reached' | 'ahead'; s: number } | { is: 'unknown' | 'not in sight' };

const NOTHING: Course = { s: 0, spp: 0, points: [], stopped: '', expected: null };

export class Convergence {
    readonly course = signal<Course>(NOTHING);
    readonly fit = computed(() => fitOf(this.course.value.points));
    private last = { at: 0, sceneRev: -1, cameraSeq: -1, method: '', rested: true };

    /** frame.stats, received at `now` in milliseconds. */
    stats(params: JsonObject, now: number): void {
        const { last } = this;
        const before = this.course.peek();
        const spp = numberOr(params.spp, 0);
        const passes = numberOr(params.passes, 0);
        const next = {
            at: now,
            sceneRev: numberOr(params.scene_rev, 0),
            cameraSeq: numberOr(params.camera_seq, 0),
            method: stringOr(params.method, ''),
            rested: params.converged === true,
        };
        const sameScene = next.sceneRev === last.sceneRev && next.method === last.method;
        // The passes since the frame before made all of its samples: another picture, unless that was its rough one.
        const anew = passes > 0 && spp <= passes && !(before.spp === 0 && sameScene && next.cameraSeq === last.cameraSeq);
        // What came after a rest took as long as it was worked on.
        const took = (last.rested || anew ? numberOr(params.ms, 0) : now - last.at) / 1000;
        const s = (anew ? 0 : before.s) + took;
        const points = anew || !sameScene ? [] : before.points;
        const error = spp > 0 && s > 0 && isObject(params.error) ? errorOf(params.error) : null;
        const known = error && error.fresh >= FRESH && error.bound > 0;
        this.course.value = {
            s,
            spp,
            points: known ? withPoint(points, { s, bound: error.bound, rel: error.rel }) : points,
            stopped: stringOr(params.stopped_by, ''),
            expected: params.converged === true ? null : expectedOf(params),
        };
        this.last = next;
    }

    /** When the picture is as good as `stop` asks; sceneSpp: the samples at which "exact" ends. */
    outlook(stop: Stop, sceneSpp: number): Outlook {
        const target = STOPS[stop];
        const course = this.course.value;
        return target === null ? samplesOutlook(course, sceneSpp) : errorOutlook(course, this.fit.value, target);
    }

    /** There is no picture any more. */
    reset(): void {
        this.course.value = NOTHING;
        this.last.rested = true;
    }
}

function expectedOf({ predicted, spent_ms }: JsonObject): Expected | null {
    if (!isObject(predicted) || predicted.stopped_by !== 'error') return null;
    const left = (ms: Json | undefined): number => Math.max(0, numberOr(ms, 0) - numberOr(spent_ms, 0)) / 1000;
    return { s: left(predicted.ms), least: left(predicted.ms_least), most: predicted.ms_most === null ? null : left(predicted.ms_most) };
}

function withPoint(points: readonly Point[], p: Point): Point[] {
    const beforeLast = points.at(-2);
    return [...(beforeLast && p.s < SAME_TIME * beforeLast.s ? points.slice(0, -1) : points), p];
}

/** Least squares; error does not grow with time, nor fall faster than 1 / time. null: too early to tell. */
export function fitOf(points: readonly Point[]): Fit | null {
    const end = points.at(-1)?.s ?? 0;
    const recent = points.filter((p) => p.s * RECENT >= end);
    if (recent.length < FIT_POINTS || end < FIT_SPAN * recent[0]!.s) return null;
    const x = recent.map((p) => Math.log(p.s));
    const y = recent.map((p) => Math.log(p.bound));
    const mean = (v: number[]): number => v.reduce((a, b) => a + b, 0) / v.length;
    const [mx, my] = [mean(x), mean(y)];
    const xy = mean(x.map((v, i) => (v - mx) * (y[i]! - my)));
    const xx = mean(x.map((v) => (v - mx) ** 2));
    const slope = Math.min(0, Math.max(-1, xy / xx));
    return { slope, at1s: Math.exp(my - slope * mx) };
}

function errorOutlook({ s, points, stopped }: Course, fit: Fit | null, target: number): Outlook {
    const first = points.find((p) => p.bound <= target);
    if (first) return { is: 'reached', s: first.s };
    if (stopped === 'black') return { is: 'not in sight' };
    if (!fit) return { is: 'unknown' };
    const then = fit.slope < 0 ? Math.max(s, (target / fit.at1s) ** (1 / fit.slope)) : Infinity;
    return then - s < LONGEST_S ? { is: 'ahead', s: then } : { is: 'not in sight' };
}

/** Each sample takes as long as the others. */
function samplesOutlook({ s, spp, stopped }: Course, sceneSpp: number): Outlook {
    if (stopped === 'spp' || spp >= sceneSpp) return { is: 'reached', s };
    if (spp < FEW_SAMPLES) return { is: 'unknown' };
    return { is: 'ahead', s: (s * sceneSpp) / spp };
}

/** What is known now, in words. */
export function knownError(error: ErrorNumbers | null): string {
    if (!error) return 'How far the picture is off is not known yet.';
    if (error.bound > LOOSE) return `How far the picture is off is being measured: so far all that is sure is less than ${percent(error.bound)}.`;
    const about = error.rel > 0 ? `about ${percent(error.rel)}` : 'less than can be told from noise';
    return `At most ${percent(error.bound)} off (${about}), 95 % sure.`;
}

/** What is of the pictures before pales, and stays readable: --dim on --panel keeps a contrast of 4.5. */
export function opacityOf(fresh: number): number {
    return 0.78 + 0.22 * fresh;
}

/** When `name` is reached, in a sentence; s: now. */
export function outlookInWords(name: string, outlook: Outlook, s: number): string {
    switch (outlook.is) {
        case 'reached':
            return `${name} was reached after ${duration(outlook.s)}.`;
        case 'ahead':
            return `${name} in about ${duration(outlook.s - s)}.`;
        case 'not in sight':
            return `${name} is not in sight.`;
        default:
            return `Too early to tell when ${name.charAt(0).toLowerCase()}${name.slice(1)} will be reached.`;
    }
}

/** The same as the server expects it. */
export function expectedInWords(name: string, { s, least, most }: Expected): string {
    const range = most === null ? `${duration(least)} or more` : `${duration(least)} to ${duration(most)}`;
    return `${name} in about ${duration(s)} (${range}).`;
}

/** The curve for those who do not see it. */
export function courseInWords(points: readonly Point[], target: number | null): string {
    const [first, last] = [points[0], points.at(-1)];
    if (!first || !last) return 'Error over time: nothing measured yet';
    const at = (p: Point): string => `at most ${percent(p.bound)} after ${duration(p.s)}`;
    const aim = target === null ? '' : `; refined until ${percent(target)}`;
    const fall = points.length > 1 ? `${at(first)}, ${at(last)}, ${number(points.length)} points` : at(first);
    return `Error over time: ${fall}${aim}`;
}
