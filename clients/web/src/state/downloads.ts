/** Files that the browser saves: the scene, pictures, what sensors show, a report. */
import { signal, type ReadonlySignal } from '@preact/signals';
import type { JsonObject } from '../protocol/rpc';
import { numberOr, stringOr } from '../protocol/types';
import type { Shot } from './compare';
import type { SceneMirror } from './scene';
import { sceneFile } from './scene_ops';
import type { Sensors } from './sensors';
import type { Toasts } from './toasts';

export interface DownloadsHost {
    scene: SceneMirror;
    sensors: Sensors;
    toasts: Toasts;
    /** The server can be asked. */
    online: ReadonlySignal<boolean>;
    /** Of the picture on screen; null: there is none. */
    viewId: () => number | null;
    call: (method: string, params: JsonObject) => Promise<JsonObject>;
    onError: (error: Error) => void;
}

export class Downloads {
    /** The server writes the scene as a glTF file. */
    readonly exporting = signal(false);
    /** A report is being made. */
    readonly reporting = signal(false);
    /** What is made of it, in words; '': that is not known. */
    readonly reportStage = signal('');

    constructor(private readonly host: DownloadsHost) {}

    /** As a file that `lumend --scene` reads. */
    async scene(): Promise<void> {
        const { scene, toasts, call, onError } = this.host;
        try {
            const { ops } = await call('scene.get', { expand: false });
            const title = `scene at revision ${scene.rev.value}`;
            save('scene.jsonl', sceneFile(Array.isArray(ops) ? ops : [], title), 'application/jsonl');
            toasts.info('Saved as scene.jsonl: lumend --scene scene.jsonl opens it');
        } catch (error) {
            onError(error as Error);
        }
    }

    /** As a glTF file, which the browser fetches beside the page: it may be large, and the browser says how far it is. */
    async model(): Promise<void> {
        if (this.exporting.value) return;
        this.exporting.value = true;
        try {
            saveFrom(stringOr((await this.host.call('scene.export', {})).get, ''), 'scene.glb');
        } catch (error) {
            this.host.onError(error as Error);
        } finally {
            this.exporting.value = false;
        }
    }

    picture({ name, canvas }: Shot): void {
        canvas.toBlob((blob) => blob && saveAs(`${name}.png`, blob));
    }

    async csv(): Promise<void> {
        try {
            save('sensors.csv', await this.host.sensors.csv(), 'text/csv');
        } catch (error) {
            this.host.onError(error as Error);
        }
    }

    /** A page to print, of what this view sees and the sensors show. */
    async report(): Promise<void> {
        const { toasts, online, call, onError } = this.host;
        if (!online.value || this.reporting.value) return;
        const viewId = this.host.viewId();
        this.reporting.value = true;
        toasts.info('Measuring, and taking pictures for the report: that takes some seconds');
        try {
            const { html } = await call('report.get', viewId === null ? {} : { view_id: viewId });
            save('report.html', stringOr(html, ''), 'text/html');
            toasts.info('Saved as report.html: open it to read or print it');
        } catch (error) {
            onError(error as Error);
        } finally {
            this.reporting.value = false;
            this.reportStage.value = '';
        }
    }

    /** report.progress */
    notified(params: JsonObject): void {
        if (this.reporting.value) this.reportStage.value = reportInWords(params);
    }
}

/** "Measuring: 1 of 3 sensors done"; "Picture: 2 of 4 samples". */
export function reportInWords({ stage, done, of }: JsonObject): string {
    const [n, all] = [numberOr(done, 0), numberOr(of, 0)];
    if (stage === 'sensors') return `Measuring: ${n} of ${all} ${all === 1 ? 'sensor' : 'sensors'} done`;
    return stage === 'picture' || stage === 'illuminance' ? `${stage === 'picture' ? 'Picture' : 'Picture of illuminance'}: ${n} of ${all} samples` : '';
}

const save = (name: string, text: BlobPart, type: string): void => saveAs(name, new Blob([text], { type }));

export function saveAs(name: string, blob: Blob): void {
    const url = URL.createObjectURL(blob);
    saveFrom(url, name);
    setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

function saveFrom(url: string, name: string): void {
    const link = document.createElement('a');
    link.href = url;
    link.download = name;
    link.click();
}
