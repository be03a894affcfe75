/** The luminaires that the server's asset folder offers: which there are, what their files say, and how one is dragged into the picture. */
import { computed, effect, signal, type ReadonlySignal } from '@preact/signals';
import { byName } from '../lib/ids';
import { ClosedError, isObject, type JsonObject } from '../protocol/rpc';
import { stringOr, type Pick } from '../protocol/types';
import { factsOf, found, type Facts } from './luminaires';

export interface LibraryHost {
    online: ReadonlySignal<boolean>;
    call(method: string, params: JsonObject): Promise<JsonObject>;
    pick(x: number, y: number): Promise<Pick | null>;
    /** At a place of the picture; null: under the ceiling in front of the camera. */
    place(asset: string, heightM: number, at: readonly [number, number] | null): Promise<boolean>;
}

/** A luminaire under the pointer, on its way into the picture. */
export interface Drag {
    asset: string;
    /** Of the pointer, in the window. */
    x: number;
    y: number;
    /** Where that is in the picture; null: elsewhere. */
    at: readonly [number, number] | null;
    /** What is there; undefined: not known yet. */
    on: Pick | null | undefined;
}

/** Read at a time: the server reads one after the other. */
const AT_ONCE = 2;

export class Library {
    /** null: not known yet. */
    readonly assets = signal<readonly string[] | null>(null);
    /** There may be more than are listed. */
    readonly whole = signal(true);
    readonly problem = signal('');
    readonly search = signal('');
    readonly chosen = signal<string | null>(null);
    readonly drag = signal<Drag | null>(null);
    /** By asset; a text says why its file was refused. */
    readonly facts = signal<ReadonlyMap<string, Facts | string>>(new Map());
    readonly found = computed(() => {
        const words = this.search.value.toLowerCase().split(/\s+/).filter((w) => w !== '');
        const last = this.last.value;
        const named = this.assets.value ?? [];
        const all = last.size === 0 ? named : [...named.filter((a) => !last.has(a)), ...named.filter((a) => last.has(a))];
        return words.length === 0 ? all : all.filter((a) => found(a, this.nameOf(a), words));
    });
    /** Known to be refused. The chosen one joins them when another is chosen: it does not leave the hand that is on it. */
    private readonly last = signal<ReadonlySet<string>>(new Set());
    private readonly wanted = new Set<string>();
    private readonly asked = new Set<string>();
    private looking = false;

    constructor(private readonly host: LibraryHost) {
        effect(() => {
            const was = this.last.peek();
            const refused = [...this.facts.value].filter(([, told]) => typeof told === 'string').map(([asset]) => asset);
            const last = refused.filter((asset) => was.has(asset) || asset !== this.chosen.value);
            if (last.length !== was.size) this.last.value = new Set(last);
        });
    }

    /** Asks for the list; again, it may have changed. */
    async load(): Promise<void> {
        try {
            const told = await this.host.call('asset.list', { kind: 'photometry' });
            const assets = Array.isArray(told.assets) ? told.assets.filter(isObject).map((a) => stringOr(a.asset, '')) : [];
            this.assets.value = assets.sort(byName);
            this.whole.value = told.whole !== false;
            this.problem.value = '';
        } catch (error) {
            if (!(error instanceof ClosedError)) this.problem.value = (error as Error).message;
        }
    }

    /** Those are in sight: what is read next. Names are searched, so that a search wants all. */
    want(inSight: readonly string[]): void {
        this.wanted.clear();
        for (const asset of inSight) this.wanted.add(asset);
        if (this.search.peek().trim() !== '') for (const asset of this.assets.peek() ?? []) this.wanted.add(asset);
        this.next();
    }

    factsOf(asset: string): Facts | null {
        const facts = this.facts.value.get(asset);
        return facts && typeof facts !== 'string' ? facts : null;
    }

    /** True: it is in the scene. */
    place(asset: string, at: readonly [number, number] | null): Promise<boolean> {
        const facts = this.facts.peek().get(asset);
        const height = facts && typeof facts !== 'string' ? facts.size[2] : 0;
        return this.host.place(asset, height, at);
    }

    dragTo(asset: string, x: number, y: number, at: readonly [number, number] | null): void {
        this.drag.value = { asset, x, y, at, on: at ? this.drag.peek()?.on : undefined };
        void this.look();
    }

    /** Let go. */
    drop(): void {
        const drag = this.drag.peek();
        this.drag.value = null;
        if (drag?.at) void this.place(drag.asset, drag.at);
    }

    cancelDrag(): void {
        this.drag.value = null;
    }

    /** What is under the pointer, one question at a time. */
    private async look(): Promise<void> {
        const at = this.drag.peek()?.at;
        if (this.looking || !at) return;
        this.looking = true;
        const on = await this.host.pick(...at);
        this.looking = false;
        const now = this.drag.peek();
        if (!now?.at) return;
        this.drag.value = { ...now, on };
        if (now.at !== at) void this.look();
    }

    private nameOf(asset: string): string {
        return this.factsOf(asset)?.name ?? '';
    }

    private next(): void {
        for (const asset of this.wanted) {
            if (this.asked.size >= AT_ONCE || !this.host.online.peek()) return;
            this.wanted.delete(asset);
            if (!this.facts.peek().has(asset) && !this.asked.has(asset)) void this.read(asset);
        }
    }

    private async read(asset: string): Promise<void> {
        this.asked.add(asset);
        try {
            const facts = factsOf(await this.host.call('asset.photometry', { asset }));
            this.facts.value = new Map(this.facts.peek()).set(asset, facts);
        } catch (error) {
            // What was not answered may be asked again.
            if (!(error instanceof ClosedError)) this.facts.value = new Map(this.facts.peek()).set(asset, (error as Error).message);
        }
        this.asked.delete(asset);
        this.next();
    }
}
