/**
 * Edits on their way to the server.
 *
 * set() is for sliders and drags: newest value wins per field, at most one message per animation frame, at most two
 * unanswered. All of one gesture shares an undo group, so that one undo takes back the whole drag.
 */
import { Pacer } from '../lib/pacer';
import { ClosedError, type Json, type JsonObject } from '../protocol/rpc';
import type { Op } from '../protocol/types';
import type { SceneMirror } from './scene';

const MAX_IN_FLIGHT = 2;

interface Field {
    id: string;
    path: string;
    value: Json;
}

interface Batch {
    group: string;
    fields: Map<string, Field>;
}

export interface EditsHost {
    call(method: string, params: JsonObject): Promise<JsonObject>;
    onError(error: Error): void;
    /** An edit was accepted as revision `rev`; it was sent at `sentAt` (performance.now() clock). */
    onAccepted(rev: number, sentAt: number): void;
}

export class Edits {
    private batches: Batch[] = [];
    private inFlight = 0;
    private gestures = 0;
    private group: string | null = null;
    private readonly pacer = new Pacer(() => this.flush());
    /** Distinguishes this page's undo groups from those of the session before a reload. */
    private readonly prefix = Math.random().toString(36).slice(2, 10);

    constructor(
        private readonly scene: SceneMirror,
        private readonly host: EditsHost,
    ) {}

    /** One field of a running gesture. Several calls before the next frame travel as one transaction. */
    set(id: string, path: string, value: Json): void {
        this.group ??= `${this.prefix}-${++this.gestures}`;
        let batch = this.batches[this.batches.length - 1];
        if (!batch || batch.group !== this.group) {
            batch = { group: this.group, fields: new Map() };
            this.batches.push(batch);
        }
        batch.fields.set(`${id} ${path}`, { id, path, value });
        this.scene.expect(id, path, value);
        this.pacer.request();
    }

    /** The slider was let go: the next set() is another undo step. */
    endGesture(): void {
        this.group = null;
    }

    /** One field, one undo step. */
    setOnce(id: string, path: string, value: Json): void {
        this.endGesture();
        this.set(id, path, value);
        this.endGesture();
    }

    /** Any ops, all or nothing, one undo step. */
    transaction(ops: Op[]): Promise<boolean> {
        this.endGesture();
        return this.request('scene.apply', { ops: ops as Json[] });
    }

    /** The same, when the caller tells what went wrong: null when nothing did. */
    attempt(ops: Op[]): Promise<Error | null> {
        this.endGesture();
        return this.ask('scene.apply', { ops: ops as Json[] });
    }

    undo(): Promise<boolean> {
        this.endGesture();
        return this.request('scene.undo', {});
    }

    redo(): Promise<boolean> {
        this.endGesture();
        return this.request('scene.redo', {});
    }

    /** The connection is gone: what was not accepted is forgotten, and the fields fall back. */
    drop(): void {
        for (const batch of this.batches) this.settle(batch, false);
        this.batches = [];
        this.group = null;
    }

    private flush(): void {
        while (this.inFlight < MAX_IN_FLIGHT) {
            const batch = this.batches.shift();
            if (!batch) return;
            void this.send(batch);
        }
    }

    private async send(batch: Batch): Promise<void> {
        const ops: Op[] = [...batch.fields.values()].map((f) => ({ op: 'set', ...f }));
        this.inFlight++;
        const accepted = await this.request('scene.apply', { ops: ops as Json[], undo_group: batch.group });
        this.inFlight--;
        this.settle(batch, accepted);
        if (this.batches.length > 0) this.pacer.request();
    }

    private settle(batch: Batch, accepted: boolean): void {
        for (const f of batch.fields.values()) this.scene.settle(f.id, f.path, f.value, accepted);
    }

    private async request(method: string, params: JsonObject): Promise<boolean> {
        const error = await this.ask(method, params);
        if (error && !(error instanceof ClosedError)) this.host.onError(error);
        return !error;
    }

    private async ask(method: string, params: JsonObject): Promise<Error | null> {
        const sentAt = performance.now();
        try {
            const reply = await this.host.call(method, params);
            if (typeof reply.scene_rev === 'number') this.host.onAccepted(reply.scene_rev, sentAt);
            return null;
        } catch (error) {
            return error as Error;
        }
    }
}
