/** What is moved by hand stops at a grid in metres, what is turned at a step in degrees: while a switch is on, or Ctrl is held; with both, freely. */
import { signal } from '@preact/signals';
import { recall, remember } from '../lib/store';
import type { Vec3 } from '../lib/vec';

export const SNAP_LIMITS = { grid: { min: 0.001, max: 100 }, angle: { min: 0.1, max: 90 } };

/** free: as the hand goes; grid: to the nearest place of the grid; step: by a key, which is to get there from anywhere. */
export type How = 'free' | 'grid' | 'step';

/** Less than this an axis was not meant to move: a tenth of what numbers are kept to. */
const STILL_M = 1e-4;

export const snapTo = (v: number, step: number): number => Math.round(v / step) * step;

/** Axes along which it stays where it was are left alone: a lamp that is moved over the floor keeps its height. */
export const snapPoint = (to: Vec3, from: Vec3, step: number): Vec3 =>
    to.map((v, i) => (Math.abs(v - from[i]!) < STILL_M ? from[i]! : snapTo(v, step))) as unknown as Vec3;

/** The next place of the grid along the one axis that leads most in the direction from `from` to `to`. */
export function stepTowards(to: Vec3, from: Vec3, step: number): Vec3 {
    const way = to.map((v, i) => v - from[i]!);
    const axis = way.reduce((best, v, i) => (Math.abs(v) > Math.abs(way[best]!) ? i : best), 0);
    const sign = Math.sign(way[axis]!);
    // On the grid already, give or take rounding: one further.
    const next = sign * step * (Math.floor((sign * from[axis]!) / step + 1e-6) + 1);
    return from.map((v, i) => (i === axis && sign !== 0 ? next : v)) as unknown as Vec3;
}

const KEY = 'lumend.snap';

export class Snap {
    readonly on = signal(false);
    readonly gridM = signal(0.1);
    readonly angleDeg = signal(15);

    constructor() {
        const [grid, angle] = (recall('localStorage', KEY) ?? '').split(' ').map(Number);
        const within = (v: number | undefined, { min, max }: { min: number; max: number }): v is number => v !== undefined && v >= min && v <= max;
        if (within(grid, SNAP_LIMITS.grid)) this.gridM.value = grid;
        if (within(angle, SNAP_LIMITS.angle)) this.angleDeg.value = angle;
    }

    set(gridM: number, angleDeg: number): void {
        this.gridM.value = gridM;
        this.angleDeg.value = angleDeg;
        remember('localStorage', KEY, `${gridM} ${angleDeg}`);
    }

    how({ ctrlKey, metaKey }: { ctrlKey: boolean; metaKey: boolean }, byKey: boolean): How {
        if (this.on.peek() === (ctrlKey || metaKey)) return 'free';
        return byKey ? 'step' : 'grid';
    }

    point(to: Vec3, from: Vec3, how: How): Vec3 {
        if (how === 'free') return to;
        return how === 'grid' ? snapPoint(to, from, this.gridM.peek()) : stepTowards(to, from, this.gridM.peek());
    }
}

interface Angles {
    tilt: number;
    turn: number;
}

/** grid: both to the nearest multiple. step: a key, which takes the one that it turns more to the next. */
export function snapAngles(to: Angles, from: Angles, how: How, stepDeg: number): Angles {
    if (how !== 'step') return { tilt: Math.min(180, snapTo(to.tilt, stepDeg)), turn: snapTo(to.turn, stepDeg) };
    const turned = ((((to.turn - from.turn + 180) % 360) + 360) % 360) - 180;
    const sideways = turned * Math.sin((from.tilt * Math.PI) / 180);
    const next = (v: number, sign: number): number => sign * stepDeg * (Math.floor((sign * v) / stepDeg + 1e-3) + 1);
    // Straight down all ways are the same: it is tilted that way first.
    if (from.tilt < 1) return { tilt: stepDeg, turn: snapTo(to.turn, stepDeg) };
    if (Math.abs(sideways) > Math.abs(to.tilt - from.tilt)) return { tilt: from.tilt, turn: next(from.turn, Math.sign(sideways)) };
    return { tilt: Math.min(180, Math.max(0, next(from.tilt, Math.sign(to.tilt - from.tilt)))), turn: from.turn };
}
