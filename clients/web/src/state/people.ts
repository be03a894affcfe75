/** Who else is in the scene: where they stand and what they point at. And what they are told of this page. */
import { computed, effect, signal, type ReadonlySignal } from '@preact/signals';
import type { Vec3 } from '../lib/vec';
import { isObject, type Json, type JsonObject } from '../protocol/rpc';
import { numberOr, stringOr, vec3Or, type CameraPose, type Pick } from '../protocol/types';
import { roleOf, type Role } from './role';

export interface Person {
    session: string;
    /** For people; two never have the same. */
    name: string;
    role: Role;
    /** Of their marks; the name is beside it. */
    colour: string;
    camera: CameraPose | null;
    point: Vec3 | null;
}

/** Told apart by those who confuse hues, too, by how light they are; all have a contrast of 4.5 on the panel's greys, which a test holds. */
export const COLOURS = ['#6cb6ff', '#ffb547', '#7ee0a0', '#ff9bb8', '#d8c8ff', '#e8e05a', '#55d6d6', '#ff9470'] as const;

/** As the server tells it, no faster: LUM_LIMIT_PRESENCE_PER_S. */
const PAUSE_MS = 100;
/** What is under a moving pointer is looked for so often, a ray each. */
const PICK_PAUSE_MS = 250;

export interface PeopleHost {
    call(method: string, params: JsonObject): Promise<JsonObject>;
    online: ReadonlySignal<boolean>;
    pose: ReadonlySignal<CameraPose>;
    /** Nobody waits for what it finds, so that a refusal is not told. */
    pick(x: number, y: number): Promise<Pick | null>;
    announce(text: string): void;
}

export class People {
    /** In the order in which the server has them, this page's own session left out. */
    readonly others = computed(() => this.all.value.filter((p) => p.session !== this.own));
    private readonly all = signal<readonly Person[]>([]);
    private readonly known = new Map<string, Known>();
    private own = '';
    private told = '';
    private point: Vec3 | null = null;
    private timer: ReturnType<typeof setTimeout> | undefined;
    private pointer: readonly [number, number] | null = null;
    private looking = false;

    constructor(private readonly host: PeopleHost) {
        effect(() => {
            void host.pose.value;
            if (this.others.value.length > 0) this.soon();
        });
    }

    /** On a new connection: says where this page stands, and hears of the others from then on. */
    async begin(session: string): Promise<void> {
        this.own = session;
        this.told = '';
        await this.say();
    }

    closed(): void {
        this.all.value = [];
    }

    notified(params: JsonObject): void {
        const before = new Map(this.others.peek().map((p) => [p.session, p.name]));
        this.all.value = peopleIn(params.people, this.known);
        const now = new Set(this.others.peek().map((p) => p.session));
        const came = this.others.peek().filter((p) => !before.has(p.session)).map((p) => `${p.name} is here`);
        const left = [...before].filter(([session]) => !now.has(session)).map(([, name]) => `${name} left`);
        if (came.length + left.length > 0) this.host.announce([...came, ...left].join(', '));
    }

    /** Fractions of the picture; null: the pointer is elsewhere. Nobody looks: nothing is asked. */
    pointAt(place: readonly [number, number] | null): void {
        this.pointer = place;
        if (place === null) this.point = null; // who comes next is not told where it once was
        if (this.others.peek().length > 0) void this.look();
    }

    private async look(): Promise<void> {
        if (this.looking) return;
        this.looking = true;
        const { pointer } = this;
        const hit = pointer && (await this.host.pick(...pointer).catch(() => null));
        this.point = this.pointer === null ? null : (hit?.point ?? null);
        this.soon();
        setTimeout(() => {
            this.looking = false;
            if (this.pointer !== pointer) void this.look();
        }, PICK_PAUSE_MS);
    }

    private soon(): void {
        this.timer ??= setTimeout(() => {
            this.timer = undefined;
            if (this.host.online.peek()) void this.say();
        }, PAUSE_MS);
    }

    private async say(): Promise<void> {
        const params: JsonObject = { camera: this.host.pose.peek() as unknown as Json, point: this.point as unknown as Json };
        const text = JSON.stringify(params);
        if (text === this.told) return;
        this.told = text;
        await this.host.call('presence.set', params).catch(() => (this.told = ''));
    }
}

/** "ann.0-1.3" is Ann's; that of a page without a token of its own says nothing of who it is. */
function nameOf(session: string, person: string): string {
    const name = person || session.replace(/\.[0-9.-]+_*$/, '');
    return name === '' || name.startsWith('lumend-web') ? 'Guest' : name;
}

/** What somebody is known by for as long as she is here. */
export type Known = Readonly<{ name: string; colour: string }>;

/** known: of those that are here, by session; filled, and those that left are taken out of it. */
export function peopleIn(list: Json | undefined, known: Map<string, Known> = new Map()): Person[] {
    const told = Array.isArray(list) ? list.filter(isObject) : [];
    const sessions = told.map((p) => stringOr(p.session, ''));
    for (const session of known.keys()) if (!sessions.includes(session)) known.delete(session);
    return told.map((p, i) => {
        const session = sessions[i]!;
        const before = known.get(session) ?? newcomer(nameOf(session, stringOr(p.person, '')), [...known.values()]);
        known.set(session, before);
        return { session, ...before, role: roleOf(p.role), camera: cameraIn(p.camera), point: Array.isArray(p.point) ? vec3Or(p.point, [0, 0, 0]) : null };
    });
}

/** The colour that the fewest have, and a name that nobody has. */
function newcomer(name: string, others: readonly Known[]): Known {
    const worn = (colour: string): number => others.filter((o) => o.colour === colour).length;
    const fewest = Math.min(...COLOURS.map(worn));
    const names = [name, ...others.map((_, i) => `${name} ${i + 2}`)];
    return { name: names.find((n) => others.every((o) => o.name !== n))!, colour: COLOURS.find((c) => worn(c) === fewest)! };
}

function cameraIn(camera: Json | undefined): CameraPose | null {
    if (!isObject(camera)) return null;
    return { position: vec3Or(camera.position, [0, 0, 0]), target: vec3Or(camera.target, [0, 0, -1]), up: vec3Or(camera.up, [0, 1, 0]), vfov_deg: numberOr(camera.vfov_deg, 45) };
}
