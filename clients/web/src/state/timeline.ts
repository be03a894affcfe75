/** What the scene was: moments, who made them and when. Looked at in this view alone; going back to one is an edit. */
import { computed, effect, signal, untracked, type ReadonlySignal } from '@preact/signals';
import { Debounce } from '../lib/debounce';
import { isObject, type Json, type JsonObject } from '../protocol/rpc';
import { numberOr, stringOr } from '../protocol/types';
import { personOf } from './comeback';

export interface Moment {
    rev: number;
    /** null: nobody knows. */
    at: Date | null;
    name: string;
    who: string;
    /** '' of the first: what was there. */
    did: string;
    /** Of revert. */
    to: number;
    joined: number;
    changes: readonly (readonly string[])[];
    n: number;
}

/** LUM_LIMIT_MOMENT_NAME_BYTES */
export const MOST_NAME_BYTES = 120;
export const SPEEDS = [1, 2, 5] as const;
/** Edits of a drag come faster. */
const REST_MS = 200;
const CAP_MS = 1000;
/** A moment that takes longer to be drawn is not waited for. */
const DRAWN_MS = 3000;

export function momentsIn(list: Json | undefined): Moment[] {
    return (Array.isArray(list) ? list : []).filter(isObject).map((m) => ({
        rev: numberOr(m.scene_rev, 0),
        at: typeof m.at_ms === 'number' ? new Date(m.at_ms) : null,
        name: stringOr(m.name, ''),
        who: personOf(stringOr(m.user, '')),
        did: stringOr(m.did, ''),
        to: numberOr(m.to, 0),
        joined: numberOr(m.joined, 1),
        changes: (Array.isArray(m.changes) ? m.changes : []) as unknown as string[][],
        n: numberOr(m.n_changes, 0),
    }));
}

const FIELDS: Record<string, string> = {
    ...{ flux_lm: 'brightness', intensity_cd: 'brightness', luminance_cd_m2: 'brightness', illuminance_lx: 'brightness', multiplier: 'brightness', on: 'switch' },
    ...{ color: 'colour', cct_k: 'colour', base_color: 'colour', position: 'place', transform: 'place', direction: 'aim' },
};
const VERBS: Record<string, string> = { undo: 'undid ', redo: 'did again: ', revert: '' };

function changeInWords([what, id = '', detail = '']: readonly string[]): string {
    if (what === 'set') return `${FIELDS[detail] ?? detail.replaceAll('_', ' ')} of ${id}`;
    return what === 'add' ? `${id} added` : `${id} removed`;
}

/** "brightness of key, and 3 more" */
export function didInWords(m: Moment, all: readonly Moment[]): string {
    if (m.did === '') return 'as it began';
    if (m.joined > 1) return `${m.joined} steps`;
    if (m.did === 'revert') return `back to ${titleOf(all.find((o) => o.rev === m.to), m.to)}`;
    const first = m.changes[0];
    const more = m.n > 1 ? `, and ${m.n - 1} more` : '';
    return `${VERBS[m.did] ?? ''}${first ? changeInWords(first) : 'nothing'}${more}`;
}

export const timeOf = (at: Date | null): string => at?.toLocaleTimeString([], { hour: '2-digit', minute: '2-digit', second: '2-digit' }) ?? '';

/** Its name, else when it was. */
export const titleOf = (m: Moment | undefined, rev: number): string => m?.name || (m?.at ? timeOf(m.at) : `revision ${m?.rev ?? rev}`);

/** As much of it as the server takes, which counts bytes. */
export const fittingName = (text: string): string => text.slice(0, new TextEncoder().encodeInto(text, new Uint8Array(MOST_NAME_BYTES)).read);

export interface TimelineHost {
    call(method: string, params: JsonObject): Promise<JsonObject>;
    onError(error: Error): void;
    announce(text: string): void;
    /** Somebody sees it. */
    open: ReadonlySignal<boolean>;
    /** Counts changes of the scene and of names. */
    changed: ReadonlySignal<number>;
    /** The moment that is looked at; null: now. */
    moment: ReadonlySignal<number | null>;
    look(rev: number | null): void;
    /** Revision of the picture on screen. */
    shown: ReadonlySignal<number>;
    revert(rev: number): Promise<boolean>;
}

export class Timeline {
    /** Oldest first; the last is now. */
    readonly moments = signal<readonly Moment[]>([]);
    readonly playing = signal(false);
    readonly speed = signal<number>(2);
    /** Of the moment that is looked at; where that is not listed any more, of the one before it. */
    readonly index = computed(() => {
        const rev = this.host.moment.value;
        const list = this.moments.value;
        return Math.max(0, (rev === null ? list : list.filter((m) => m.rev <= rev)).length - 1);
    });
    /** undefined: it is not listed, or not yet. */
    readonly here = computed<Moment | undefined>(() => {
        const rev = this.host.moment.value;
        return rev === null ? this.moments.value.at(-1) : this.moments.value.find((m) => m.rev === rev);
    });
    readonly isNow = computed(() => this.host.moment.value === null);
    private readonly later = new Debounce(() => void this.refresh(), REST_MS, CAP_MS);

    constructor(private readonly host: TimelineHost) {
        effect(() => {
            void host.changed.value;
            if (host.open.peek()) this.later.request();
        });
        effect(() => {
            if (host.open.value) void untracked(() => this.refresh());
        });
    }

    async refresh(): Promise<void> {
        const reply = await this.host.call('timeline.get', {}).catch((error: unknown) => (this.host.onError(error as Error), null));
        if (reply) this.moments.value = momentsIn(reply.moments);
    }

    look(index: number): void {
        const list = this.moments.peek();
        const i = Math.max(0, Math.min(list.length - 1, index));
        const rev = i < list.length - 1 ? list[i]!.rev : null;
        if (rev !== this.host.moment.peek()) this.host.look(rev);
    }

    /** From what is not listed to what is beside it. */
    step(n: number): void {
        this.look(this.index.peek() + n + (n < 0 && !this.here.peek() ? 1 : 0));
    }

    async back(): Promise<void> {
        const m = this.here.peek();
        if (!m || this.isNow.peek()) return;
        this.playing.value = false;
        if (await this.host.revert(m.rev)) this.host.announce(`The scene is as it was: ${titleOf(m, m.rev)}. Undo takes that back`);
    }

    /** rev: of the moment. False: it was refused, and why is said. */
    async name(text: string, rev: number): Promise<boolean> {
        const m = this.moments.peek().find((o) => o.rev === rev);
        const name = fittingName(text).trim();
        if (name === m?.name) return true;
        const which = m === this.here.peek() ? 'This moment' : `The moment of ${titleOf(m, rev)}`;
        let done = true;
        try {
            await this.host.call('timeline.name', { scene_rev: rev, name });
            this.host.announce(name ? `${which} is ${name}` : `${which} has no name any more`);
        } catch (error) {
            done = false;
            this.host.onError(error as Error);
        }
        await this.refresh();
        return done;
    }

    /** From the moment that is looked at, or from the first. Each is drawn before the next. */
    async play(): Promise<void> {
        if (this.playing.peek()) {
            this.playing.value = false;
            return;
        }
        this.playing.value = true;
        this.host.announce('Playing');
        if (this.isNow.peek()) this.look(0);
        while (this.playing.peek()) {
            await Promise.all([new Promise((r) => setTimeout(r, 1000 / this.speed.peek())), this.drawn()]);
            if (!this.playing.peek() || this.isNow.peek()) break;
            this.look(this.index.peek() + 1);
        }
        if (this.playing.peek()) this.host.announce('Played to now');
        this.playing.value = false;
    }

    private drawn(): Promise<void> {
        return new Promise((done) => {
            const timer = setTimeout(() => end(), DRAWN_MS);
            let stop: (() => void) | null = null;
            const end = (): void => {
                clearTimeout(timer);
                queueMicrotask(() => stop?.());
                done();
            };
            stop = effect(() => {
                if (this.isNow.value || this.host.shown.value === this.host.moment.value) end();
            });
        });
    }
}
