/** Models brought into the scene from the server's asset folder, and rooms made where there is no model. */
import { signal } from '@preact/signals';
import { newId } from '../lib/ids';
import { RpcError } from '../protocol/rpc';
import { stringOr, type CameraPose, type SceneRecord } from '../protocol/types';
import type { Edits } from './edits';
import { roomOps, type Room } from './room_make';
import type { SceneMirror } from './scene';
import type { Toasts } from './toasts';

/** "models/Big Room.glb" -> "big-room", made unique among the ids that exist. Ids of imports have room for 32 bytes. */
export function idForAsset(asset: string, taken: (id: string) => boolean): string {
    const file = asset.split('/').pop() ?? '';
    const stem = file.replace(/\.[^.]*$/, '').toLowerCase();
    const id = stem.replace(/[^a-z0-9_.-]+/g, '-').replace(/^-+|-+$/g, '').slice(0, 28) || 'import';
    return newId(id, taken);
}

/** What went wrong, and what can be done, for who asked for the file. */
export function explainImport(error: Error, asset: string): string {
    if (!(error instanceof RpcError)) return `${sentence(error.message)} Try again when the server is back.`;
    switch (error.app) {
        case 'not_found':
            return `There is no “${asset}” in the server’s asset folder. Check its name, and the folder before it.`;
        case 'invalid_value':
            return `“${asset}” is no name of a file below the asset folder. Write it like room.glb or models/room.glb.`;
        case 'import_failed':
            return `${sentence(error.message)} The file may be damaged or incomplete: export it again.`;
        case 'busy':
            return `${sentence(error.message)} Wait for the others to end.`;
        case 'limit_exceeded':
            return `${sentence(error.message)} Make the model smaller, or import parts of it.`;
        case 'unsupported':
            return `${sentence(error.message)} Export it as plain glTF (.glb) and try again.`;
        default:
            return sentence(error.message);
    }
}

const sentence = (text: string): string => text.charAt(0).toUpperCase() + text.slice(1).replace(/[.\s]*$/, '.');

export interface Progress {
    stage: string;
    fraction: number;
}

export interface ImportsHost {
    scene: SceneMirror;
    edits: Edits;
    toasts: Toasts;
    lookAt(id: string): void;
    moveTo(pose: CameraPose): void;
}

export class Imports {
    readonly selected = signal<string | null>(null);
    /** False: the server has no asset folder. */
    readonly offered = signal(true);
    readonly busy = signal(false);
    /** null: none runs, or nothing was heard of it yet. */
    readonly progress = signal<Progress | null>(null);
    /** Why the last one failed; "" when it did not. */
    readonly problem = signal('');
    /** The form of a new room is open. */
    readonly planning = signal(false);

    constructor(private readonly host: ImportsHost) {}

    /** True when the model is in the scene. */
    async bring(asset: string): Promise<boolean> {
        const { scene, edits } = this.host;
        const id = idForAsset(asset, (taken) => scene.peek(taken) !== undefined);
        this.problem.value = '';
        this.busy.value = true;
        const error = await edits.attempt([{ op: 'import', id, asset }]);
        this.busy.value = false;
        this.progress.value = null;
        if (error) this.problem.value = explainImport(error, asset);
        else this.offer(id, asset);
        return !error;
    }

    /** An empty room, seen from one of its corners. */
    /** True: it stands. */
    async build(room: Room): Promise<boolean> {
        const { scene, edits, toasts, moveTo } = this.host;
        const { ops, pose } = roomOps(room, (id) => scene.peek(id) !== undefined);
        if (!(await edits.transaction(ops))) return false;
        this.planning.value = false;
        moveTo(pose);
        toasts.announce(`A room of ${room.length} by ${room.width} m, ${room.height} m high`);
        return true;
    }

    remove(id: string): void {
        void this.host.edits.transaction([{ op: 'remove', id }]);
    }

    /** The import that a record came with. */
    importOf(record: SceneRecord | undefined): string | null {
        const id = stringOr(record?.origin, '');
        return this.host.scene.peek(id)?.type === 'import' ? id : null;
    }

    /** After any change of the scene. */
    forgetIfGone(): void {
        const id = this.selected.peek();
        if (id && !this.host.scene.peek(id)) this.selected.value = null;
    }

    private offer(id: string, asset: string): void {
        this.selected.value = id;
        this.host.toasts.info(`Imported ${asset} as ${id}`, [
            { label: 'Look at it', run: () => this.host.lookAt(id) },
            { label: 'Undo', run: () => this.remove(id) },
        ]);
    }
}
