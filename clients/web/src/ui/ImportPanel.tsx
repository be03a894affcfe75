import { useSignal } from '@preact/signals';
import { idForAsset } from '../state/imports';
import { useApp } from './context';

export function ImportPanel() {
    const app = useApp();
    const asset = useSignal('');
    const busy = useSignal(false);
    const submit = async (): Promise<void> => {
        const name = asset.value.trim();
        if (!name || busy.value) return;
        busy.value = true;
        const id = idForAsset(name, (taken) => app.scene.peek(taken) !== undefined);
        const done = await app.edits.transaction([{ op: 'import', id, asset: name }]);
        busy.value = false;
        app.importProgress.value = null;
        if (!done) return;
        asset.value = '';
        app.toasts.info(`Imported ${name} as ${id}`);
    };
    return (
        <section class="section" aria-labelledby="import-title">
            <header class="section-head">
                <h2 id="import-title">Import</h2>
            </header>
            <form
                class="import"
                onSubmit={(e) => {
                    e.preventDefault();
                    void submit();
                }}
            >
                <input
                    type="text"
                    aria-label="Model file below the server's asset folder"
                    placeholder="room.glb"
                    spellcheck={false}
                    autocomplete="off"
                    maxLength={255}
                    value={asset.value}
                    onInput={(e) => (asset.value = e.currentTarget.value)}
                />
                <button type="submit" class="button" disabled={busy.value}>
                    {busy.value ? 'Importing…' : 'Import'}
                </button>
            </form>
            {busy.value && <ImportProgress />}
            <p class="hint">A file in the server's asset folder: glTF, GLB, OBJ, FBX …</p>
        </section>
    );
}

function ImportProgress() {
    const progress = useApp().importProgress.value;
    return (
        <label class="progress">
            <span>{progress?.stage ?? 'starting'}</span>
            <progress max="1" value={progress?.fraction} />
        </label>
    );
}
