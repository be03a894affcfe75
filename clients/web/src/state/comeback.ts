/** A connection that broke and came back: what others did meanwhile, and whether the picture shows the scene as it is now. */
import { computed, signal } from '@preact/signals';
import { isObject, type Json, type JsonObject } from '../protocol/rpc';
import { numberOr, stringOr } from '../protocol/types';

const NAMED = 3;

/** "ann" of "ann.3-1". */
export const personOf = (user: string): string => user.replace(/\.\d+-\d+[._\d]*$/, '');

const idsOf = (ops: Json | undefined): string[] => (Array.isArray(ops) ? ops : []).map((op) => (isObject(op) ? stringOr(op.id, '') : ''));

function listed(words: readonly string[]): string {
    const more = words.length - NAMED;
    return more > 0 ? `${words.slice(0, NAMED).join(', ')} and ${more} more` : words.join(', ');
}

export class Comeback {
    /** The newest revision that the server had when the connection was there again; null: nothing has to be caught up with. */
    private readonly wantedRev = signal<number | null>(null);
    private readonly lost = signal(false);
    /** The picture may show another scene than the one there is. */
    readonly isStale = computed(() => this.lost.value || this.wantedRev.value !== null);
    private left = 0;
    private others = new Map<string, Set<string>>();

    /** tell: says a sentence to the user. */
    constructor(private readonly tell: (text: string) => void) {}

    connectionLost(): void {
        this.lost.value = true;
        this.left = 0;
    }

    /** True: the copy of the scene becomes that of the server by the changes that come now. */
    online(hello: JsonObject, isFirst: boolean): boolean {
        const missed = hello.resumed === true && typeof hello.missed === 'number' ? hello.missed : null;
        this.lost.value = false;
        this.wantedRev.value = isFirst ? null : numberOr(hello.scene_rev, 0);
        this.left = missed ?? 0;
        this.others = new Map();
        if (missed === null && hello.resumed === true) this.tell('The scene was changed a lot while you were away');
        return missed !== null;
    }

    /** A scene.changed. */
    changed(params: JsonObject, mine: boolean): void {
        if (this.left === 0) return;
        this.left--;
        const person = personOf(stringOr(params.user, ''));
        const ids = this.others.get(person) ?? new Set<string>();
        if (!mine) this.others.set(person, new Set([...ids, ...idsOf(params.ops)]));
        if (this.left > 0 || this.others.size === 0) return;
        const what = new Set([...this.others.values()].flatMap((s) => [...s]));
        this.tell(`While you were away ${listed([...this.others.keys()])} changed ${listed([...what])}`);
    }

    /** A whole frame is on the canvas. */
    drawn(sceneRev: number): void {
        if (this.wantedRev.value !== null && sceneRev >= this.wantedRev.value) this.wantedRev.value = null;
    }
}
