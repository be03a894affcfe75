import { useComputed } from '@preact/signals';
import { percentOf } from '../lib/format';
import { stringOr, type SceneRecord } from '../protocol/types';
import { finishOf } from '../state/finishes';
import { lightOf, mapsOf } from '../state/material';
import { useApp } from './context';
import { Editing } from './Editing';
import { Lazy } from './Lazy';

const materialDetails = () => import('./MaterialDetails').then((m) => m.MaterialDetails);

/** What the picked object is made of. */
export function MaterialPanel() {
    const app = useApp();
    const shown = app.materials.shown.value;
    const none = app.scene.list('material').value.length === 0;
    const record = shown === null ? undefined : app.scene.record(shown);
    return (
        <section class="section material" aria-labelledby="material-title">
            <header class="section-head">
                <h2 id="material-title">Material</h2>
            </header>
            {none ? <p class="hint">Nothing is made of anything yet.</p> : <Which />}
            {record && <Lazy key={record.id} when load={materialDetails} with={{ m: record }} />}
        </section>
    );
}

/** The list of all, and how the picked object stands to the one on show. A panel of its own: it is long, and seldom new. */
function Which() {
    const { materials, scene } = useApp();
    const ids = scene.list('material').value;
    const shown = materials.shown.value;
    const object = materials.object.value;
    return (
        <>
            <label class="choice">
                <span class="visually-hidden">Material on show</span>
                <select value={shown ?? ''} onChange={(e) => materials.choose(e.currentTarget.value || null)}>
                    {shown === null && <option value="">Choose one, or click on an object</option>}
                    {ids.map((id) => (
                        <option key={id} value={id}>
                            {id}
                        </option>
                    ))}
                </select>
            </label>
            {shown !== null && <Carriers shown={shown} object={object} />}
        </>
    );
}

/** Who shares it: a change is one of all of them. */
function Carriers({ shown, object }: { shown: string; object: string | null }) {
    const { materials, scene } = useApp();
    const n = useComputed(() => (scene.rev.value, scene.objectsOf(materials.shown.value ?? '').length)).value;
    const isOwn = materials.own.value === shown;
    const others = n - 1;
    const of = !isOwn || object === null ? `On ${n === 1 ? '1 object' : `${n} objects`}` : others === 0 ? `On ${object} alone` : `On ${object} and ${others === 1 ? '1 other' : `${others} others`}`;
    return (
        <Editing>
            <div class="carriers">
                <span class="carriers-of">{of}</span>
                {object !== null && isOwn && others > 0 && (
                    <button type="button" class="toggle" title={`A copy for ${object}: the others keep theirs`} onClick={() => void materials.makeOwn()}>
                        Make its own
                    </button>
                )}
                {object !== null && !isOwn && (
                    <button type="button" class="toggle" title={`${object} is made of ${shown} from then on`} onClick={() => void materials.putOn()}>
                        Put it on {object}
                    </button>
                )}
            </div>
        </Editing>
    );
}

/** In a word, for the card of what was picked. */
export function materialInWords(m: SceneRecord): string {
    const { rho, tau } = lightOf(m);
    const told = mapsOf(m).includes('colour') ? '' : `, ρ ${percentOf(rho)}`;
    return `${stringOr(finishOf(m)?.name, m.id)}${told}${tau > 0.005 ? `, τ ${percentOf(tau)}` : ''}`;
}
