import { useEffect, useRef } from 'preact/hooks';
import { swatch } from '../lib/colour';
import { number } from '../lib/format';
import { logScale } from '../lib/scale';
import type { SceneRecord } from '../protocol/types';
import { isReplaced } from '../state/daylight';
import { colourOf, dimmedAsInModel, intensityOf, isDaylight, isOn, modelFluxOf, nameOf, type Unit } from '../state/lights';
import { useApp } from './context';
import { Editing } from './Editing';
import { Lazy } from './Lazy';
import { lineProps, type Place } from './lines';
import { Slider } from './Slider';

/** Of a dimmer's keys: 5 %, and a factor of two. */
export function dimmerSteps({ min, max }: Unit): { arrow: number; page: number } {
    const decades = Math.log(max / min);
    return { arrow: Math.log(1.05) / decades, page: Math.LN2 / decades };
}

const lightDetails = () => import('./LightDetails').then((m) => m.LightDetails);

interface RowProps {
    id: string;
    inGroup: boolean;
    place: Place;
    /** Of the lamps in the list. */
    order(): readonly string[];
}

export function LightRow({ id, inGroup, place, order }: RowProps) {
    const app = useApp();
    const light = app.scene.record(id);
    const many = app.selection.many.value;
    const chosen = app.selection.chosen.value;
    const selected = app.lamps.selected.value === id;
    const row = useRef<HTMLLIElement>(null);
    useEffect(() => {
        if (selected) row.current?.scrollIntoView({ block: 'nearest' });
    }, [selected]);
    if (!light) return null;
    const on = isOn(light);
    const tabIndex = place.reachable ? 0 : -1;
    const { field, value, unit, automatic } = intensityOf(light);
    const model = field === 'flux_lm' ? modelFluxOf(light) : null;
    const sky = app.shiningSky.value;
    const replaced = isReplaced(light, sky);
    return (
        <li
            ref={row}
            {...lineProps(place)}
            class={`light ${chosen.has(id) ? 'is-selected' : ''} ${on ? '' : 'is-off'} ${inGroup ? 'in-group' : ''} ${replaced || app.isHidden(id) ? 'is-hidden' : ''}`}
        >
            <div class="light-head">
                <Editing>
                    <OnOff light={light} on={on} tabIndex={tabIndex} />
                </Editing>
                <button
                    type="button"
                    class="light-name"
                    data-column="name"
                    tabIndex={tabIndex}
                    title={id}
                    aria-expanded={selected}
                    aria-pressed={many.length > 0 ? chosen.has(id) : undefined}
                    onClick={(e) => app.selection.click(id, e, order())}
                >
                    {nameOf(light)}
                </button>
                {replaced ? (
                    <span class="light-value" title="It comes back when that sky is switched off">
                        replaced by {sky}
                    </span>
                ) : (
                    <span class="light-value">
                        {automatic ? 'automatic' : number(value)} {!automatic && <small>{unit.symbol}</small>}
                    </span>
                )}
                {app.mayEdit.value && isDaylight(light) && !automatic && (
                    <BackButton
                        label={`${id}: as bright as place, date and time make it`}
                        title="Automatic: as bright as place, date and time make it"
                        tabIndex={tabIndex}
                        onClick={() => app.edits.setOnce(id, `/${field}`, null)}
                    />
                )}
                <ModelButton
                    name={id}
                    value={value}
                    model={model}
                    tabIndex={tabIndex}
                    onClick={() => void app.edits.transaction([dimmedAsInModel(id)])}
                />
                <SoloButton name={id} label={id} n={1} tabIndex={tabIndex} />
            </div>
            <Slider
                label={`${id} intensity`}
                tabIndex={tabIndex}
                disabled={!app.mayEdit.value}
                scale={logScale(unit.min, unit.max)}
                value={value}
                steps={dimmerSteps(unit)}
                mark={model}
                spoken={automatic ? 'automatic' : `${number(value)} ${unit.spoken}`}
                onInput={(v) => app.edits.set(id, `/${field}`, v)}
                onEnd={() => app.edits.endGesture()}
            />
            {selected && (
                <Editing>
                    <Lazy when load={lightDetails} with={{ light, onShown: () => row.current?.scrollIntoView({ block: 'nearest' }) }} />
                </Editing>
            )}
            <OthersMark id={id} />
        </li>
    );
}

/** A lamp in the colour of its light; dark when off. */
function OnOff({ light, on, tabIndex }: { light: SceneRecord; on: boolean; tabIndex: number }) {
    const app = useApp();
    return (
        <button
            type="button"
            role="switch"
            class="lamp-switch"
            data-column="on"
            tabIndex={tabIndex}
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

interface ModelProps {
    name: string;
    value: number;
    model: number | null;
    tabIndex: number;
    onClick(): void;
}

/** The way back to the tick of a dimmer; there only where the value is another one. */
export function ModelButton({ name, value, model, tabIndex, onClick }: ModelProps) {
    if (!useApp().mayEdit.value || model === null || Math.abs(value - model) <= 1e-4 * model) return null;
    const label = `${name}: back to the ${number(model)} lumens of the model`;
    return <BackButton label={label} title={`Back to the model’s ${number(model)} lm`} tabIndex={tabIndex} onClick={onClick} />;
}

function BackButton({ label, title, tabIndex, onClick }: { label: string; title: string; tabIndex: number; onClick(): void }) {
    return (
        <button type="button" class="solo is-back" data-column="model" tabIndex={tabIndex} aria-label={label} title={title} onClick={onClick}>
            ↺
        </button>
    );
}

/** name: of a lamp or a group; n: how many lamps that are. */
export function SoloButton({ name, label, n, tabIndex }: { name: string; label: string; n: number; tabIndex: number }) {
    const app = useApp();
    const soloed = app.view.settings.value.solo.includes(name);
    return (
        <button
            type="button"
            class="solo"
            data-column="solo"
            tabIndex={tabIndex}
            aria-pressed={soloed}
            aria-label={`Solo ${label}`}
            title={soloed ? 'Show the other lights again' : `Only ${n > 1 ? 'these lights' : 'this light'}, in your view alone`}
            onClick={() => app.toggleSolo(name)}
        >
            S
        </button>
    );
}

/** Lights up for a moment when somebody else edits this record. A new key restarts the animation. */
export function OthersMark({ id }: { id: string }) {
    const { ids, count } = useApp().touchedByOthers.value;
    return ids.has(id) ? <span key={count} class="others-mark" aria-hidden="true" /> : null;
}
