/** Which material is looked at, and what is done to it as a whole. */
import { computed, signal } from '@preact/signals';
import { newId } from '../lib/ids';
import { stringOr, type Op, type SceneRecord } from '../protocol/types';
import type { Edits } from './edits';
import { fieldsOf, type Finish } from './finishes';
import type { SceneMirror } from './scene';
import { addOf } from './scene_ops';
import type { Toasts } from './toasts';

/** With what follows it an id has at most 64 bytes. */
const MOST_STEM = 48;

export interface MaterialsHost {
    scene: SceneMirror;
    edits: Edits;
    toasts: Toasts;
}

export class Materials {
    /** What was picked in the picture; null: nothing that is made of anything. */
    readonly object = signal<string | null>(null);
    /** Chosen by name; null: that of the object. */
    private readonly chosen = signal<string | null>(null);
    /** Of the object, as somebody may give it another one. */
    readonly own = computed(() => {
        const { scene } = this.host;
        const id = stringOr(scene.record(this.object.value ?? '')?.material, '');
        return scene.record(id)?.type === 'material' ? id : null;
    });
    /** The material on show; null: none. */
    readonly shown = computed(() => {
        const { scene } = this.host;
        const chosen = this.chosen.value;
        return chosen !== null && scene.record(chosen)?.type === 'material' ? chosen : this.own.value;
    });

    constructor(private readonly host: MaterialsHost) {}

    /** Of what was picked: an object, or something else. */
    pick(record: SceneRecord | undefined): void {
        this.object.value = record?.type === 'object' ? record.id : null;
        this.chosen.value = null;
    }

    choose(material: string | null): void {
        this.chosen.value = material === this.own.value ? null : material;
    }

    forgetIfGone(): void {
        const { scene } = this.host;
        for (const which of [this.object, this.chosen]) if (which.value !== null && !scene.peek(which.value)) which.value = null;
    }

    /** A copy for the picked object alone. */
    async makeOwn(): Promise<void> {
        const { scene, edits, toasts } = this.host;
        const [object, own] = [this.object.value, this.own.value];
        const record = own === null ? undefined : scene.peek(own);
        if (object === null || !record) return;
        const id = newId(`${object.slice(object.lastIndexOf('/') + 1).slice(0, MOST_STEM)}-material`, (taken) => scene.peek(taken) !== undefined);
        const ops: Op[] = [addOf(record, id), { op: 'set', id: object, path: '/material', value: id }];
        if (!(await edits.transaction(ops))) return;
        this.chosen.value = null;
        toasts.announce(`${object} has a material of its own, ${id}`);
    }

    /** The picked object is made of what is on show. */
    async putOn(): Promise<void> {
        const { edits, toasts } = this.host;
        const [object, shown] = [this.object.value, this.shown.value];
        if (object === null || shown === null) return;
        if (await edits.transaction([{ op: 'set', id: object, path: '/material', value: shown }])) toasts.announce(`${object} is made of ${shown}`);
    }

    async finish(id: string, finish: Finish): Promise<void> {
        const { edits, toasts } = this.host;
        if (await edits.transaction([{ op: 'set', id, path: '', value: fieldsOf(finish) }])) toasts.announce(`${id} is ${finish.name}`);
    }
}
