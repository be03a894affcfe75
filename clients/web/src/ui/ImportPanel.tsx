import { useSignal } from '@preact/signals';
import { useEffect, useRef } from 'preact/hooks';
import { useApp } from './context';
import { ChooseFiles } from './DropFiles';
import { Editing } from './Editing';
import { ImportRow } from './ImportRow';
import { Lazy } from './Lazy';

const roomForm = () => import('./RoomForm').then((m) => m.RoomForm);

const HINT = 'A file in the server’s asset folder: glTF, GLB, OBJ, FBX …';

const NOT_OFFERED = 'This server was started without an asset folder (--assets), so nothing can be imported.';

export function ImportPanel() {
    const { imports, scene, uploads } = useApp();
    const isEmpty = scene.rev.value > 0 && scene.idsOfType('object').length === 0;
    return (
        <section class="section" aria-labelledby="import-title">
            <Editing>
                <header class="section-head">
                    <h2 id="import-title">Models</h2>
                    {isEmpty && (
                        <button type="button" class="toggle at-end" aria-expanded={imports.planning.value} onClick={() => (imports.planning.value = !imports.planning.value)}>
                            Empty room…
                        </button>
                    )}
                </header>
                {isEmpty && imports.planning.value && <Lazy when load={roomForm} with={{}} />}
                {imports.offered.value ? <ImportForm /> : uploads.offered.value ? <ImportState /> : <p class="hint">{NOT_OFFERED}</p>}
                {uploads.offered.value && <ChooseFiles />}
                <ul class="light-list">
                    {scene.list('import').value.map((id) => (
                        <ImportRow key={id} id={id} />
                    ))}
                </ul>
            </Editing>
        </section>
    );
}

function ImportForm() {
    const { imports } = useApp();
    const asset = useSignal('');
    const submit = async (): Promise<void> => {
        const name = asset.value.trim();
        if (name && !imports.busy.value && (await imports.bring(name))) asset.value = '';
    };
    const failed = imports.problem.value !== '';
    return (
        <>
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
                    aria-invalid={failed}
                    aria-describedby="import-hint"
                    placeholder="room.glb"
                    spellcheck={false}
                    autocomplete="off"
                    maxLength={255}
                    value={asset.value}
                    onInput={(e) => {
                        asset.value = e.currentTarget.value;
                        imports.problem.value = '';
                    }}
                />
                <button type="submit" class="button" disabled={imports.busy.value}>
                    {imports.busy.value ? 'Importing…' : 'Import'}
                </button>
            </form>
            <ImportState hint={HINT} />
        </>
    );
}

function ImportState({ hint }: { hint?: string }) {
    const { imports } = useApp();
    return (
        <>
            {imports.busy.value && <ImportProgress />}
            <div id="import-hint">
                {imports.problem.value !== '' ? <Problem text={imports.problem.value} /> : hint && <p class="hint">{hint}</p>}
            </div>
        </>
    );
}

function Problem({ text }: { text: string }) {
    const line = useRef<HTMLParagraphElement>(null);
    useEffect(() => line.current?.scrollIntoView({ block: 'nearest' }), [text]);
    return (
        <p ref={line} class="problem" role="alert">
            {text}
        </p>
    );
}

function ImportProgress() {
    const progress = useApp().imports.progress.value;
    return (
        <label class="progress">
            <span>{progress?.stage ?? 'starting'}</span>
            <progress max="1" value={progress?.fraction} />
        </label>
    );
}
