import { useEffect, useRef } from 'preact/hooks';
import { swatch } from '../lib/colour';
import { number } from '../lib/format';
import { logScale } from '../lib/scale';
import type { SceneRecord } from '../protocol/types';
import { colourOf, dimmedAsInModel, intensityOf, isOn, modelFluxOf, nameOf, type Unit } from '../state/lights';
import { useApp } from './context';
import { LightDetails } from './LightDetails';
import { Slider } from './Slider';

/** Of a dimmer's keys: 5 %, and a factor of two. */
export function dimmerSteps({ min, max }: Unit): { arrow: number; page: number } {
    const decades = Math.log(max / min);
    return { arrow: Math.log(1.05) / decades, page: Math.LN2 / decades };
}

export function LightRow({ id }: { id: string }) {
    const app = useApp();
    const light = app.scene.record(id);
    const selected = app.selectedLight.value === id;
    const row = useRef<HTMLLIElement>(null);
    useEffect(() => {
        if (selected) row.current?.scrollIntoView({ block: 'nearest' });
    }, [selected]);
    if (!light) return null;
    const on = isOn(light);
    const { field, value, unit } = intensityOf(light);
    const model = field === 'flux_lm' ? modelFluxOf(light) : null;
    return (
        <li ref={row} class={`light ${selected ? 'is-selected' : ''} ${on ? '' : 'is-off'}`}>
            <div class="light-head">
                <OnOff light={light} on={on} />
                <button
                    type="button"
                    class="light-name"
                    title={id}
                    aria-expanded={selected}
                    onClick={() => (app.selectedLight.value = selected ? null : id)}
                >
                    {nameOf(light)}
                </button>
                <span class="light-value">
                    {number(value)} <small>{unit.symbol}</small>
                </span>
                <ModelButton name={id} value={value} model={model} onClick={() => void app.edits.transaction([dimmedAsInModel(id)])} />
                <SoloButton name={id} ids={[id]} />
            </div>
            <Slider
                label={`${id} intensity`}
                scale={logScale(unit.min, unit.max)}
                value={value}
                steps={dimmerSteps(unit)}
                mark={model}
                spoken={`${number(value)} ${unit.spoken}`}
                onInput={(v) => app.edits.set(id, `/${field}`, v)}
                onEnd={() => app.edits.endGesture()}
            />
            {selected && <LightDetails light={light} />}
            <OthersMark id={id} />
        </li>
    );
}

/** A lamp in the colour of its light; dark when off. */
function OnOff({ light, on }: { light: SceneRecord; on: boolean }) {
    const app = useApp();
    return (
        <button
            type="button"
            role="switch"
            class="lamp-switch"
            aria-checked={on}
            aria-label={`${light.id} on`}
            title={on ? 'Switch off' : 'Switch on'}
            style={{ '--lamp': swatch(colourOf(light).linear) }}
            onClick={() => app.edits.setOnce(light.id, '/on', !on)}
        >
            <span class="lamp-dot" />
        </button>
    );
}

/** The way back to the tick of a dimmer; there only where the value is another one. */
export function ModelButton({ name, value, model, onClick }: { name: string; value: number; model: number | null; onClick(): void }) {
    if (model === null || Math.abs(value - model) <= 1e-4 * model) return null;
    return (
        <button
            type="button"
            class="solo is-back"
            aria-label={`${name}: back to the ${number(model)} lumens of the model`}
            title={`Back to the model’s ${number(model)} lm`}
            onClick={onClick}
        >
            ↺
        </button>
    );
}

export function SoloButton({ name, ids }: { name: string; ids: readonly string[] }) {
    const app = useApp();
    const soloed = ids.every((id) => app.solo.isSoloed(id));
    return (
        <button
            type="button"
            class="solo"
            aria-pressed={soloed}
            aria-label={`Solo ${name}`}
            title={soloed ? 'Bring the other lights back' : ids.length > 1 ? 'Only these lights' : 'Only this light'}
            onClick={() => app.toggleSolo(ids)}
        >
            S
        </button>
    );
}

/** Lights up for a moment when somebody else edits this light. A new key restarts the animation. */
function OthersMark({ id }: { id: string }) {
    const { ids, count } = useApp().touchedByOthers.value;
    return ids.has(id) ? <span key={count} class="others-mark" aria-hidden="true" /> : null;
}
