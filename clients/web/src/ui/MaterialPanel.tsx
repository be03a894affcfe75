import { useComputed, useSignal } from '@preact/signals';
import { useRef } from 'preact/hooks';
import { number } from '../lib/format';
import { stringOr, type SceneRecord } from '../protocol/types';
import { FINISHES, finishOf, inWords } from '../state/finishes';
import { isUsed, lightOf, mapsOf, PARTS, type Part } from '../state/material';
import { useApp } from './context';
import { Editing } from './Editing';
import { OthersMark } from './LightRow';
import { BaseFields, PART_NAMES, PartFields } from './MaterialFields';

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
            {record && <Details key={record.id} m={record} />}
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

/** A part that came into use stays where it is: who drags its slider keeps it in hand. */
function Details({ m }: { m: SceneRecord }) {
    const more = useSignal(false);
    const seen = useRef(new Set<Part>()).current;
    for (const part of PARTS) if (isUsed(m, part)) seen.add(part);
    const idle = PARTS.filter((part) => !seen.has(part));
    return (
        <div class="material-fields">
            <Editing>
                <Finish m={m} />
                <BaseFields m={m} />
            </Editing>
            <Sum m={m} />
            <Editing>
                {PARTS.map((part) => (more.value || seen.has(part)) && <PartGroup key={part} m={m} part={part} />)}
            </Editing>
            {idle.length > 0 && (
                <button type="button" class="toggle more" aria-expanded={more.value} onClick={() => (more.value = !more.value)}>
                    {more.value ? 'Less' : `More: ${idle.map((part) => PART_NAMES[part].toLowerCase()).join(', ')}`}
                </button>
            )}
            <OthersMark id={m.id} />
        </div>
    );
}

function PartGroup({ m, part }: { m: SceneRecord; part: Part }) {
    return (
        <div class="part" role="group" aria-label={PART_NAMES[part]}>
            <h3>{PART_NAMES[part]}</h3>
            <PartFields m={m} part={part} />
        </div>
    );
}

function Finish({ m }: { m: SceneRecord }) {
    const { materials } = useApp();
    const kinds = [...new Set(FINISHES.map((f) => f.kind))];
    return (
        <label class="choice">
            <span class="field-label">Finish</span>
            <select
                value={finishOf(m)?.name ?? ''}
                onChange={(e) => {
                    const finish = FINISHES.find((f) => f.name === e.currentTarget.value);
                    if (finish) void materials.finish(m.id, finish);
                }}
            >
                <option value="" disabled>
                    As set below
                </option>
                {kinds.map((kind) => (
                    <optgroup key={kind} label={kind}>
                        {FINISHES.filter((f) => f.kind === kind).map((f) => (
                            <option key={f.name} value={f.name}>
                                {f.name}, {inWords(f)}
                            </option>
                        ))}
                    </optgroup>
                ))}
            </select>
        </label>
    );
}

const percent = (share: number): string => `${number(Math.round(1000 * share) / 10)} %`;

/** What becomes of light that falls on it. */
function Sum({ m }: { m: SceneRecord }) {
    const { rho, tau, solid } = lightOf(m);
    const maps = mapsOf(m);
    const cloth = isUsed(m, 'cloth');
    return (
        <div id="rho-is" class="hint sum">
            <p>
                Reflects {percent(rho)}
                {tau > 0 && `, lets ${percent(tau)} through`}
                {!solid && `, keeps ${percent(Math.max(0, 1 - rho - tau))}`}
                {'. '}
                Of light from the front, gloss included, as data sheets measure it (LRV).
            </p>
            {solid && <p>What goes through solid glass depends on its thickness.</p>}
            {maps.length > 0 && <p>Its pictures of {maps.join(', ')} come on top: these are the values where they are white.</p>}
            {cloth && <p>The fuzz is not counted.</p>}
            {m.unlit === true && <p>Shown as it is, without light (unlit).</p>}
        </div>
    );
}

/** In a word, for the card of what was picked. */
export function materialInWords(m: SceneRecord): string {
    const { rho, tau } = lightOf(m);
    const told = mapsOf(m).includes('colour') ? '' : `, ρ ${percent(rho)}`;
    return `${stringOr(finishOf(m)?.name, m.id)}${told}${tau > 0.005 ? `, τ ${percent(tau)}` : ''}`;
}
