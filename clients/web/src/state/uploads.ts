/** Files that are sent to the server, dropped onto the page or chosen, and what becomes of them: a model, a lamp, a sky. */
import { signal } from '@preact/signals';
import { newId } from '../lib/ids';
import type { JsonObject } from '../protocol/rpc';
import { stringOr, type Op, type SceneRecord } from '../protocol/types';
import { switchOff } from './daylight';
import type { Imports } from './imports';
import { isOn } from './lights';

/** By the name that the others of its drop know it by: textures/wood.png. */
export interface Named {
    name: string;
    file: File;
}

export interface UploadsHost {
    imports: Imports;
    call(method: string, params: JsonObject): Promise<JsonObject>;
    /** Puts the body there; resolves with the answer, whatever its status is. */
    put(path: string, body: Blob, onProgress: (fraction: number) => void): Promise<JsonObject>;
    /** Hangs a lamp with that photometric file. */
    hang(asset: string): Promise<unknown>;
    /** Makes the picture the sky. */
    surround(asset: string): Promise<Error | null>;
}

const KINDS = { model: /\.(glb|gltf|obj|fbx|dae|ply|stl|3ds)$/i, lamp: /\.(ies|ldt|eul|pho)$/i, sky: /\.(hdr|exr)$/i };
export type Kind = keyof typeof KINDS;

/** The file that the others belong to: a model before a lamp before a sky, of models the one least deep. */
export function mainOf(names: readonly string[]): { name: string; kind: Kind } | null {
    const depth = (name: string): number => name.split('/').length;
    for (const kind of Object.keys(KINDS) as Kind[]) {
        const [name] = names.filter((n) => KINDS[kind].test(n)).sort((a, b) => depth(a) - depth(b));
        if (name !== undefined) return { name, kind };
    }
    return null;
}

/** What systems leave beside files has a dot before its name. */
export const isHidden = (name: string): boolean => /(^|\/)\./.test(name);

export class Uploads {
    /** False: the server takes no files. */
    readonly offered = signal(false);
    /** Something is dragged over the page. */
    readonly over = signal(false);

    constructor(private readonly host: UploadsHost) {}

    async send(dropped: readonly Named[]): Promise<void> {
        const { imports, call, put } = this.host;
        const files = dropped.filter((f) => !isHidden(f.name));
        const main = mainOf(files.map((f) => f.name));
        if (imports.busy.peek() || !this.offered.peek()) return;
        imports.problem.value = '';
        if (!main) {
            imports.problem.value = 'None of these files is a model (.glb, .gltf, .obj …), a lamp (.ies, .ldt) or a sky (.hdr, .exr).';
            return;
        }
        imports.busy.value = true;
        let folder = '';
        try {
            const ticket = await call('asset.upload', { files: files.map((f) => ({ name: f.name, bytes: f.file.size })) });
            const answer = await put(stringOr(ticket.put, ''), new Blob(files.map((f) => f.file)), (fraction) => {
                imports.progress.value = { stage: `sending ${main.name}`, fraction };
            });
            folder = stringOr(answer.folder, '');
            if (!folder) imports.problem.value = stringOr(answer.error, 'The server did not take the files. Send them again.');
        } catch (error) {
            imports.problem.value = (error as Error).message;
        }
        imports.busy.value = false;
        imports.progress.value = null;
        if (folder) await this.use(`${folder}/${main.name}`, main.kind);
    }

    private async use(asset: string, kind: Kind): Promise<void> {
        const { imports, hang, surround } = this.host;
        if (kind === 'model') await imports.bring(asset);
        else if (kind === 'lamp') await hang(asset);
        else {
            const error = await surround(asset);
            if (error) imports.problem.value = error.message;
        }
    }
}

/** A picture as sky. It has its own sun, and only one sky shines: those that were there are switched off. */
export function skyOps(asset: string, lights: readonly SceneRecord[], taken: (id: string) => boolean): Op[] {
    const image = newId('sky-image', taken);
    const before = lights.filter((l) => isOn(l) && (['environment', 'sky', 'sun'].includes(stringOr(l.kind, '')) || l.id === 'default-sun'));
    return [
        ...switchOff(before),
        { op: 'add', type: 'image', id: image, asset },
        { op: 'add', type: 'light', id: newId('sky', taken), kind: 'environment', image, luminance_cd_m2: 1000 },
    ];
}

export function putByHttp(path: string, body: Blob, onProgress: (fraction: number) => void): Promise<JsonObject> {
    return new Promise((resolve, reject) => {
        const request = new XMLHttpRequest();
        request.open('PUT', new URL(path, location.href.replace(/#.*/, '')));
        request.upload.onprogress = (e) => onProgress(e.loaded / e.total);
        request.onerror = () => reject(new Error('The files were cut off on their way. Send them again.'));
        request.onload = () => {
            try {
                resolve(JSON.parse(request.responseText) as JsonObject);
            } catch {
                resolve({});
            }
        };
        request.send(body);
    });
}
