/** What one material is made of: fetched when one is on show. */
import { useSignal } from '@preact/signals';
import { useRef } from 'preact/hooks';
import { percentOf } from '../lib/format';
import type { SceneRecord } from '../protocol/types';
import { FINISHES, finishOf, inWords } from '../state/finishes';
import { isUsed, lightOf, mapsOf, PARTS, type Part } from '../state/material';
import { useApp } from './context';
import { Editing } from './Editing';
import { OthersMark } from './LightRow';
import { BaseFields, PART_NAMES, PartFields } from './MaterialFields';

/** A part that came into use stays where it is: who drags its slider keeps it in hand. */
export function MaterialDetails({ m }: { m: SceneRecord }) {
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

/** What becomes of light that falls on it. */
function Sum({ m }: { m: SceneRecord }) {
    const { rho, tau, solid } = lightOf(m);
    const maps = mapsOf(m);
    const cloth = isUsed(m, 'cloth');
    return (
        <div id="rho-is" class="hint sum">
            <p>
                Reflects {percentOf(rho)}
                {tau > 0 && `, lets ${percentOf(tau)} through`}
                {!solid && `, keeps ${percentOf(Math.max(0, 1 - rho - tau))}`}
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
