/**
 * Pictures that were kept, and the wipe between two of: now, the reference, and what was kept. All of it is in this page: neither
 * the scene nor anybody else's view knows of it.
 */
import { computed, signal } from '@preact/signals';
import { dot, length, sub } from '../lib/vec';
import { percent } from '../lib/format';
import type { CameraPose } from '../protocol/types';
import { basis } from '../view/camera';
import { LOOSE } from './convergence';
import { OVERLAYS, type OverlayName } from './view';

/** What a picture shows, and how well. */
export interface PictureFacts {
    /** Revision of the scene. */
    rev: number;
    method: string;
    spp: number;
    /** Relative, at most, with 95 % confidence; null: not known. */
    bound: number | null;
    /** EV100. */
    ev: number;
    map: OverlayName;
    solo: readonly string[];
    pose: CameraPose;
}

/** A picture that can be laid over another. */
export interface Shot {
    name: string;
    facts: PictureFacts;
    canvas: HTMLCanvasElement;
}

export interface Kept extends Shot {
    key: number;
    at: Date;
}

/** before: this user's last change, an undo too. A number: the key of a kept picture. */
export type Side = 'now' | 'before' | 'reference' | 'moment' | number;

/** Of more the oldest goes: pictures take memory, a byte for each colour of each pixel. */
export const MOST_KEPT = 12;
const MOST_PIXELS = 48e6;

export interface CompareHost {
    /** The picture on screen; null: there is none yet. */
    now(): Shot | null;
    announce(text: string): void;
}

export class Compare {
    /** The newest last. */
    readonly kept = signal<readonly Kept[]>([]);
    /** Kept without being asked; null: nothing was changed yet. */
    readonly before = signal<Shot | null>(null);
    /** What is left and right of the line; null: no wipe. */
    readonly sides = signal<readonly [Side, Side] | null>(null);
    /** Where the line is: 0 at the left border of the picture, 1 at the right. */
    readonly at = signal(0.5);
    /** Of the timeline, that was compared last. */
    readonly moment = signal<{ rev: number; name: string } | null>(null);
    readonly wantsMoment = computed(() => this.sides.value?.includes('moment') ?? false);
    readonly wantsReference = computed(() => this.sides.value?.includes('reference') ?? false);
    private focusWanted = false;
    private last: readonly [Side, Side] | null = null;
    private made = 0;

    constructor(private readonly host: CompareHost) {}

    /** Keeps what is on screen, under a name of its own. */
    keep(): Kept | null {
        const shot = this.host.now();
        if (!shot) {
            this.host.announce('There is no picture yet');
            return null;
        }
        const name = `Picture ${++this.made}`;
        const kept: Kept = { name, key: this.made, at: new Date(), facts: shot.facts, canvas: copyOf(shot.canvas) };
        const all = [...this.kept.value, kept];
        while (all.length > MOST_KEPT || (all.length > 1 && pixelsOf(all) > MOST_PIXELS)) this.drop(all.shift()!.key);
        this.kept.value = all;
        this.host.announce(`Kept as ${name}: ${factsInWords(kept.facts)}`);
        return kept;
    }

    /** The user's hand is about to change the scene. */
    changing(): void {
        const shot = this.host.now();
        if (shot) this.before.value = { name: 'Before', facts: shot.facts, canvas: copyOf(shot.canvas, this.before.value?.canvas) };
    }

    rename(key: number, name: string): void {
        const trimmed = name.trim();
        if (trimmed) this.kept.value = this.kept.value.map((k) => (k.key === key ? { ...k, name: trimmed } : k));
    }

    forget(key: number): void {
        this.drop(key);
        this.kept.value = this.kept.value.filter((k) => k.key !== key);
    }

    /** Opens the wipe, or changes what it shows. */
    show(left: Side, right: Side = 'now'): void {
        this.sides.value = [left, right];
        this.last = [left, right];
        this.host.announce(`Left of the line ${this.nameOf(left)}, right of it ${this.nameOf(right)}. The line is in the picture, a slider`);
    }

    /** Chooses one side; what was there goes to the other, where both would be the same. */
    choose(which: 0 | 1, side: Side): void {
        const before = this.sides.value;
        if (!before) return;
        const other = before[1 - which]! === side ? before[which] : before[1 - which]!;
        this.show(...(which === 0 ? ([side, other] as const) : ([other, side] as const)));
    }

    close(): void {
        if (!this.sides.value) return;
        this.sides.value = null;
        this.host.announce('Comparison closed');
    }

    /** By a key: what was compared last, else with the newest picture that was kept, that before the last change, or the reference. The line takes
     * the focus. */
    toggle(): void {
        if (this.sides.value) {
            this.close();
            return;
        }
        this.focusWanted = true;
        const earlier = this.kept.value.at(-1)?.key ?? (this.before.value ? 'before' : 'reference');
        this.show(...(this.last ?? [earlier, 'now']));
    }

    /** True, once: whoever opened the wipe wants to move its line next. */
    takeFocus(): boolean {
        const wanted = this.focusWanted;
        this.focusWanted = false;
        return wanted;
    }

    moveTo(at: number): void {
        this.at.value = Math.min(1, Math.max(0, at));
    }

    /** All of one picture, then all of the other: what differs jumps to the eye. */
    flip(): void {
        this.at.value = this.at.value < 0.5 ? 1 : 0;
    }

    nameOf(side: Side): string {
        if (side === 'now') return 'Now';
        if (side === 'reference') return 'Reference';
        if (side === 'before') return 'Before';
        if (side === 'moment') return this.moment.value?.name ?? '';
        return this.keptOf(side)?.name ?? '';
    }

    /** null: there is none, or it is not kept here. */
    shotOf(side: Side): Shot | null {
        if (side === 'before') return this.before.value;
        return typeof side === 'number' ? (this.keptOf(side) ?? null) : null;
    }

    keptOf(key: number): Kept | undefined {
        return this.kept.value.find((k) => k.key === key);
    }

    private drop(key: number): void {
        if (this.last?.includes(key)) this.last = null;
        if (this.sides.value?.includes(key)) this.close();
    }
}

const pixelsOf = (all: readonly Kept[]): number => all.reduce((sum, { canvas }) => sum + canvas.width * canvas.height, 0);

/** into: what may be overwritten, so that a hand that changes much takes no more memory. */
function copyOf(canvas: HTMLCanvasElement, into?: HTMLCanvasElement): HTMLCanvasElement {
    const copy = into ?? canvas.ownerDocument.createElement('canvas');
    if (copy.width !== canvas.width) copy.width = canvas.width;
    if (copy.height !== canvas.height) copy.height = canvas.height;
    copy.getContext('2d', { alpha: false })?.drawImage(canvas, 0, 0);
    return copy;
}

/** "live, 64 samples, at most 0.8 % off, revision 3" */
export function factsInWords({ method, spp, bound, rev }: PictureFacts): string {
    const samples = spp === 0 ? 'rough' : spp === 1 ? '1 sample' : `${spp} samples`;
    const off = bound === null || bound > LOOSE ? 'error not known' : `at most ${percent(bound).replace(' ', '\u00a0')} off`;
    return [method, samples, off, `revision ${rev}`].filter((part) => part !== '').join(', ');
}

/** Positions apart by less than this part of the distance to what is looked at are one; so are angles, in radians. */
const SAME = 1e-4;
const SAME_DEG = 1e-3;
/** Less is not told from noise by the eye, nor in tenths. */
const SAME_EV = 0.1;

export function sameCamera(a: CameraPose, b: CameraPose): boolean {
    const [ba, bb] = [basis(a), basis(b)];
    const near = length(sub(a.position, b.position)) <= SAME * length(sub(a.target, a.position));
    const turned = (['right', 'up', 'forward'] as const).some((v) => dot(ba[v], bb[v]) < 1 - (SAME * SAME) / 2);
    return near && !turned && Math.abs(a.vfov_deg - b.vfov_deg) < SAME_DEG;
}

/** What makes two pictures differ, apart from the light: in words, of b. */
export function differences(a: PictureFacts, b: PictureFacts): string[] {
    const list: string[] = [];
    const moved = !sameCamera(a.pose, b.pose);
    if (moved) list.push('another camera');
    if (a.map !== b.map) list.push(b.map === 'none' ? 'no map' : `map of ${OVERLAYS[b.map].toLowerCase()}`);
    else if (!moved && Math.abs(a.ev - b.ev) > SAME_EV) list.push(`exposed for ${b.ev.toFixed(1)} EV, not ${a.ev.toFixed(1)}`);
    if (a.solo.join() !== b.solo.join()) list.push(b.solo.length > 0 ? `only ${b.solo.join(', ')}` : 'all lamps');
    return list;
}
