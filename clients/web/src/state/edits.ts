/**
 * Edits on their way to the server.
 *
 * set() is for sliders and drags: newest value wins per field, at most one message per animation frame, at most two
 * unanswered. All of one gesture shares an undo group, so that one undo takes back the whole drag.
 *
 * An edit that was under way when the connection broke may be in the scene or not. Where the session goes on, it is sent
 * again by its op_id, and the server does it if it did not. Else it is known by its op_id in a scene.changed, or by what the
 * scene is like when it is loaded again, and what is not in it can be sent once more.
 */
import { signal } from '@preact/signals';
import { Pacer } from '../lib/pacer';
import { ClosedError, type Json, type JsonObject } from '../protocol/rpc';
import type { Op } from '../protocol/types';
import type { SceneMirror } from './scene';
import { isDone } from './scene_ops';

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

export type ServersEdit = 'preset.store' | 'preset.recall' | 'preset.stop' | 'scene.revert';
type Method = 'scene.apply' | 'scene.undo' | 'scene.redo' | ServersEdit;

/** Of which nobody knows whether it took effect. */
interface Lost {
    opId: string;
    method: Method;
    /** Undo group; "": a step of its own. */
    group: string;
    /** Of scene.apply. */
    ops: Op[];
    /** Of the others. */
    params?: JsonObject;
    /** The user has been told, and has not asked for it. */
    told?: boolean;
}

export interface EditsHost {
    call(method: string, params: JsonObject): Promise<JsonObject>;
    onError(error: Error): void;
    /** An edit was accepted as revision `rev`; it was sent at `sentAt` (performance.now() clock). */
    onAccepted(rev: number, sentAt: number): void;
    /** False: this client is not to change anything, and has been told. */
    mayEdit(): boolean;
    /** What follows is another undo step: nothing of it is on screen yet. */
    onStep?(): void;
}

export class Edits {
    /** Something was changed that the server has not answered yet. */
    readonly busy = signal(false);
    /** Counts undo steps, undoing included: the same number, the same last step. */
    step = 0;
    private batches: Batch[] = [];
    /** Unanswered, oldest first, by op_id. */
    private readonly inFlight = new Map<string, Lost>();
    private lost: Lost[] = [];
    private sent = 0;
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
        if (!this.host.mayEdit()) return;
        if (this.group === null) {
            this.group = `${this.prefix}-${++this.gestures}`;
            this.begin();
        }
        let batch = this.batches[this.batches.length - 1];
        if (!batch || batch.group !== this.group) {
            batch = { group: this.group, fields: new Map() };
            this.batches.push(batch);
        }
        batch.fields.set(`${id} ${path}`, { id, path, value });
        this.scene.expect(id, path, value);
        this.busy.value = true;
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
        if (!this.host.mayEdit()) return Promise.resolve(false);
        this.endGesture();
        this.begin();
        return this.told(this.perform(this.edit('scene.apply', ops), true));
    }

    /** The same, when the caller tells what went wrong: null when nothing did. */
    attempt(ops: Op[]): Promise<Error | null> {
        this.endGesture();
        this.begin();
        return this.perform(this.edit('scene.apply', ops), false);
    }

    undo(): Promise<boolean> {
        if (!this.host.mayEdit()) return Promise.resolve(false);
        this.endGesture();
        this.begin();
        return this.told(this.perform(this.edit('scene.undo'), true));
    }

    redo(): Promise<boolean> {
        if (!this.host.mayEdit()) return Promise.resolve(false);
        this.endGesture();
        this.begin();
        return this.told(this.perform(this.edit('scene.redo'), true));
    }

    /** An edit that the server makes; one undo step. */
    request(method: ServersEdit, params: JsonObject): Promise<boolean> {
        if (!this.host.mayEdit()) return Promise.resolve(false);
        this.endGesture();
        this.begin();
        return this.told(this.perform({ ...this.edit(method), params }, true));
    }

    /** The connection is gone: the fields fall back, and what was under way is kept until the scene is there again. */
    drop(): void {
        this.lost = this.lost.filter((l) => !l.told);
        this.lost.push(...this.inFlight.values());
        this.inFlight.clear();
        for (const batch of this.batches) {
            this.settle(batch, false);
            this.lost.push(this.edit('scene.apply', opsOf(batch), batch.group));
        }
        this.batches = [];
        this.group = null;
        this.busy.value = false;
    }

    /** A scene.changed of this client: the edit is in the scene, whatever becomes of the reply. */
    arrived(opId: string): void {
        this.inFlight.delete(opId);
        this.lost = this.lost.filter((l) => l.opId !== opId);
    }

    /** The session goes on: what is not known to be done is sent again, in its order. The server does nothing twice. */
    async repeat(): Promise<void> {
        const again = this.lost.filter((l) => !l.told);
        this.lost = [];
        await Promise.all(again.map((l) => this.told(this.perform(l, true, true))));
    }

    /** The scene was loaded anew: how many edits are not in it, although they were made. */
    missing(): number {
        this.lost = joined(this.lost).filter((l) => !l.ops.every((op) => isDone(op, this.scene.peek(op.id))));
        for (const l of this.lost) l.told = true;
        return this.lost.length;
    }

    /** Sends them once more, and not again after that. */
    async resend(): Promise<void> {
        if (!this.host.mayEdit()) return;
        const again = this.lost.splice(0);
        for (const l of again) await this.told(this.perform(l, false));
    }

    forgetLost(): void {
        this.lost = [];
    }

    private edit(method: Method, ops: Op[] = [], group = ''): Lost {
        return { opId: this.nextOpId(), method, group, ops };
    }

    private begin(): void {
        this.step++;
        this.host.onStep?.();
    }

    private nextOpId(): string {
        return `${this.prefix}-op-${++this.sent}`;
    }

    private flush(): void {
        while (this.inFlight.size < MAX_IN_FLIGHT) {
            const batch = this.batches.shift();
            if (!batch) return;
            void this.send(batch);
        }
    }

    private async send(batch: Batch): Promise<void> {
        const accepted = await this.told(this.perform(this.edit('scene.apply', opsOf(batch), batch.group), true));
        this.settle(batch, accepted);
        if (this.batches.length > 0) this.pacer.request();
    }

    private settle(batch: Batch, accepted: boolean): void {
        for (const f of batch.fields.values()) this.scene.settle(f.id, f.path, f.value, accepted);
    }

    /** recover: keep it when the connection breaks meanwhile. repeat: it may have been done already. */
    private async perform(edit: Lost, recover: boolean, repeat = false): Promise<Error | null> {
        const { opId, method, group, ops } = edit;
        if (recover) this.inFlight.set(opId, { ...edit });
        this.busy.value = true;
        const params: JsonObject = { ...edit.params, op_id: opId };
        if (method === 'scene.apply') params.ops = ops as Json[];
        if (group) params.undo_group = group;
        if (repeat) params.repeat = true;
        const error = await this.ask(method, params);
        this.inFlight.delete(opId);
        this.busy.value = this.inFlight.size > 0 || this.batches.length > 0;
        return error;
    }

    private async told(asked: Promise<Error | null>): Promise<boolean> {
        const error = await asked;
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

const opsOf = (batch: Batch): Op[] => [...batch.fields.values()].map((f) => ({ op: 'set', ...f }));

/** All of one gesture as one. An undo is none: nobody can tell from the scene whether it was done. */
function joined(lost: readonly Lost[]): Lost[] {
    const out: Lost[] = [];
    for (const l of lost.filter((one) => one.method === 'scene.apply')) {
        const same = out.find((o) => o.group !== '' && o.group === l.group);
        if (same) same.ops = newestOf([...same.ops, ...l.ops]);
        else out.push({ ...l });
    }
    return out;
}

/** Of several sets of one field the last. */
function newestOf(ops: readonly Op[]): Op[] {
    const key = (op: Op): string => `${op.id} ${op.op === 'set' ? op.path : op.op}`;
    return [...new Map(ops.map((op) => [key(op), op])).values()];
}
