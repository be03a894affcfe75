/**
 * Is the eye in a room? There a drag turns the head and the wheel walks: an eye that orbits in a room soon looks at the backs of
 * its walls. Asked when the eye has come to rest somewhere else.
 */
import { effect, signal, type ReadonlySignal } from '@preact/signals';
import type { Vec3 } from '../lib/vec';
import type { JsonObject } from '../protocol/rpc';
import { numberOr, type CameraPose } from '../protocol/types';

/** Of all directions: a room with a wall left out has more, an object on a ground about a half. */
const ENCLOSED = 0.7;
/** An eye that goes on must not be in and out by turns. */
const LET_GO = 0.6;
const REST_MS = 250;

export interface SurroundingsHost {
    call(method: string, params: JsonObject): Promise<JsonObject>;
    viewId(): number | null;
    /** Of the picture on screen: the server knows it. */
    pose: ReadonlySignal<CameraPose>;
}

export class Surroundings {
    /** How far things are in a room, in metres; null: the eye is in none. */
    readonly room = signal<number | null>(null);
    private asked: Vec3 | null = null;
    private timer = 0;

    constructor(private readonly host: SurroundingsHost) {
        effect(() => {
            const { position } = host.pose.value;
            if (!position.every((v, i) => v === this.asked?.[i])) this.later();
        });
    }

    /** The scene is another, or the view: what is around the eye may be, too. */
    again(): void {
        this.asked = null;
        this.later();
    }

    private later(): void {
        clearTimeout(this.timer);
        this.timer = setTimeout(() => void this.ask(this.host.pose.peek().position), REST_MS) as unknown as number;
    }

    private async ask(position: Vec3): Promise<void> {
        const view_id = this.host.viewId();
        if (view_id === null) return;
        this.asked = position;
        const around = await this.host.call('surroundings', { view_id }).catch(() => null);
        if (!around) {
            this.asked = null;
            return;
        }
        const least = this.room.value === null ? ENCLOSED : LET_GO;
        this.room.value = numberOr(around.enclosed, 0) >= least ? numberOr(around.reach, 1) : null;
    }
}
