/** A hand on one of the things that are selected takes all of them along; on another one, that alone. One gesture is one step of undo. */
import { add, sub, type Vec3 } from '../lib/vec';
import type { Edits } from './edits';
import { centreOf } from './lights';
import { anchorOf, anchoredAt } from './placement';
import type { SceneMirror } from './scene';
import type { How, Snap } from './snap';
import type { Toasts } from './toasts';

export interface MoverHost {
    scene: SceneMirror;
    edits: Edits;
    toasts: Toasts;
    snap: Snap;
    /** What moves with it, it included, but for what a model takes along. */
    with(id: string): readonly string[];
}

export class Mover {
    /** Where each was when it was taken. */
    private start = new Map<string, Vec3>();
    private led = '';
    /** Where that was; a model may take it along. */
    private from: Vec3 | null = null;

    constructor(private readonly host: MoverHost) {}

    grab(id: string): void {
        const { scene } = this.host;
        this.led = id;
        this.start = new Map();
        const led = scene.peek(id);
        this.from = led ? anchorOf(led) : null;
        for (const one of this.host.with(id)) {
            const record = scene.peek(one);
            if (record) this.start.set(one, anchorOf(record));
        }
    }

    /** How far the centre of what was grabbed is to be from where it was. A step of the gesture. */
    by(delta: Vec3, how: How = 'free'): void {
        const { scene, edits, snap } = this.host;
        const { from } = this;
        if (!from) return;
        const moved = sub(snap.point(add(from, delta), from, how), from);
        for (const [id, at] of this.start) {
            const record = scene.peek(id);
            if (!record) continue;
            const { path, value } = anchoredAt(record, add(at, moved));
            edits.set(id, path, value);
        }
    }

    /** Let go, or moved by a key. */
    end(): void {
        const { scene, edits, toasts } = this.host;
        edits.endGesture();
        const record = scene.peek(this.led);
        const at = record && centreOf(record).map((v) => v.toFixed(2)).join(', ');
        const others = this.start.size - 1;
        if (at) toasts.announce(`${this.led} moved to ${at} metres${others > 0 ? `, and ${others} more with it` : ''}`);
    }
}
