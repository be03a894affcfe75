/** Keeps the copy of the scene that of the server: change by change, or whole where a change is missing or says too little. */
import { Once } from '../lib/once';
import type { JsonObject } from '../protocol/rpc';
import { numberOr } from '../protocol/types';
import type { SceneMirror } from './scene';

export class Follower {
    private readonly loads = new Once(() => this.load());
    /** The copy is not known to be that of `wantedRev`, or later. */
    private unknown = true;
    private wantedRev = 0;

    /** get: scene.get with expand. */
    constructor(
        private readonly scene: SceneMirror,
        private readonly get: () => Promise<JsonObject>,
    ) {}

    /** Of the copy; null: it is not that of the server, and has to be got. */
    get knownRev(): number | null {
        return this.unknown ? null : this.scene.rev.peek();
    }

    /** A new connection: resolves when the scene is there. */
    begin(): Promise<void> {
        this.unknown = true;
        this.wantedRev = 0;
        return this.loads.run();
    }

    /** A scene.changed: resolves when the copy shows it. However many changes do not fit, the scene is asked for once. */
    async follow(changed: JsonObject): Promise<void> {
        const rev = numberOr(changed.scene_rev, 0);
        if (this.scene.apply(changed.ops, rev, changed.emits)) return;
        this.unknown = true;
        this.wantedRev = Math.max(this.wantedRev, rev);
        await this.loads.run();
    }

    private async load(): Promise<void> {
        if (!this.unknown) return;
        const reply = await this.get();
        this.scene.load(reply.ops, numberOr(reply.scene_rev, 0));
        this.unknown = this.scene.rev.peek() < this.wantedRev;
    }
}
