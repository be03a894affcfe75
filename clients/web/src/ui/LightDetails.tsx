import { useSignal } from '@preact/signals';
import { useId } from 'preact/hooks';
import { linearFromHex, swatch, unitLuminance } from '../lib/colour';
import { number } from '../lib/format';
import { kelvinScale } from '../lib/scale';
import type { Vec3 } from '../lib/vec';
import type { Json } from '../protocol/rpc';
import { numberOr, stringOr, type SceneRecord } from '../protocol/types';
import { aimed, aimOf, anglesOf, canPointAt, directionOf, isAimed, type Angles } from '../state/lamp_make';
import { asInModel, colourOf, emitsOf, intensityOf, isAdjusted, isPlaced, kindOf } from '../state/lights';
import { anchorOf } from '../state/placement';
import { ArrayForm } from './ArrayForm';
import { useApp } from './context';
import { LuminaireFacts } from './LuminaireFacts';
import { NumberField } from './NumberField';
import { Slider } from './Slider';
import { VectorFields } from './VectorFields';

const KELVIN = kelvinScale(1800, 12000);
const PRESETS: [string, number][] = [
    ['Candle', 1900],
    ['Tungsten', 2700],
    ['Halogen', 3000],
    ['Neutral', 4000],
    ['Daylight', 5600],
    ['Overcast', 6500],
];

export function LightDetails({ light }: { light: SceneRecord }) {
    const app = useApp();
    const { field, value, unit } = intensityOf(light);
    return (
        <div class="light-details">
            <p class="kind">{kindOf(light)} light</p>
            <NumberField
                label="Intensity"
                value={value}
                unit={unit.symbol}
                min={0}
                max={1e12}
                onCommit={(v) => app.edits.setOnce(light.id, `/${field}`, v)}
            />
            <Colour light={light} />
            {emitsOf(light) ? <Surface light={light} /> : isPlaced(light) && <Position light={light} />}
            {isAimed(light) && <Aim light={light} />}
            {light.kind === 'ies' && <LuminaireFacts light={light} />}
            <Group light={light} />
            <Actions light={light} />
        </div>
    );
}

function Colour({ light }: { light: SceneRecord }) {
    const app = useApp();
    const { kelvin, linear } = colourOf(light);
    const byTemperature = kelvin !== null;
    const setMode = (temperature: boolean): void => {
        if (temperature === byTemperature) return;
        void app.edits.transaction([
            { op: 'set', id: light.id, path: '/cct_k', value: temperature ? 4000 : null },
            ...(temperature ? [] : [{ op: 'set' as const, id: light.id, path: '/color', value: [...unitLuminance(linear)] }]),
        ]);
    };
    return (
        <div class="colour">
            <div class="segmented" role="group" aria-label={`${light.id} colour mode`}>
                <button type="button" aria-pressed={byTemperature} onClick={() => setMode(true)}>
                    Temperature
                </button>
                <button type="button" aria-pressed={!byTemperature} onClick={() => setMode(false)}>
                    Colour
                </button>
                <span class="swatch" style={{ '--lamp': swatch(linear) }} />
            </div>
            {byTemperature ? <Temperature light={light} kelvin={kelvin} /> : <Picker light={light} linear={linear} />}
        </div>
    );
}

function Temperature({ light, kelvin }: { light: SceneRecord; kelvin: number }) {
    const app = useApp();
    return (
        <>
            <div class="slider-line">
                <Slider
                    class="kelvin"
                    label={`${light.id} colour temperature`}
                    scale={KELVIN}
                    value={kelvin}
                    spoken={`${kelvin} kelvin`}
                    onInput={(k) => app.edits.set(light.id, '/cct_k', k)}
                    onEnd={() => app.edits.endGesture()}
                />
                <output>
                    {number(kelvin)} <small>K</small>
                </output>
            </div>
            <div class="presets" role="group" aria-label="Colour temperature presets">
                {PRESETS.map(([name, k]) => (
                    <button
                        key={k}
                        type="button"
                        title={`${k} K`}
                        aria-pressed={k === kelvin}
                        onClick={() => app.edits.setOnce(light.id, '/cct_k', k)}
                    >
                        {name}
                    </button>
                ))}
            </div>
        </>
    );
}

function Picker({ light, linear }: { light: SceneRecord; linear: Vec3 }) {
    const app = useApp();
    return (
        <label class="picker">
            <span>Light colour</span>
            <input
                type="color"
                value={swatch(linear)}
                onInput={(e) => {
                    const colour = unitLuminance(linearFromHex(e.currentTarget.value));
                    app.edits.set(light.id, '/color', [...colour] as Json);
                }}
                onChange={() => app.edits.endGesture()}
            />
        </label>
    );
}

/** What follows from the shape of an object that shines, and the way back to its material's light. */
function Surface({ light }: { light: SceneRecord }) {
    const app = useApp();
    const emits = emitsOf(light)!;
    return (
        <p class="kind surface">
            {number(numberOr(emits.luminance_cd_m2, 0))} <small>cd/m²</small> over {number(numberOr(emits.area_m2, 0))} <small>m²</small>
            {emits.sides === 'both' ? ', both sides' : ', one side'}
            {isAdjusted(light) && (
                <button type="button" class="button" onClick={() => void app.edits.transaction([asInModel(light.id)])}>
                    As in the model
                </button>
            )}
        </p>
    );
}

function Position({ light }: { light: SceneRecord }) {
    const app = useApp();
    return (
        <VectorFields
            label={`${light.id} position in metres`}
            names={['X', 'Y', 'Z']}
            value={anchorOf(light)}
            unit="m"
            limits={[-1e9, 1e9]}
            step={0.05}
            onCommit={(position) => app.edits.setOnce(light.id, '/position', [...position])}
        />
    );
}

/** Where its light goes: as angles, or by picking what it points at. */
function Aim({ light }: { light: SceneRecord }) {
    const app = useApp();
    const { tilt, turn } = anglesOf(aimOf(light));
    const aiming = app.lamps.aiming.value === light.id;
    const set = (angles: Angles): void => {
        const op = aimed(light, directionOf(angles));
        if (op.op === 'set') app.edits.setOnce(op.id, op.path, op.value);
    };
    return (
        <div class="fields is-aim" role="group" aria-label={`${light.id} aim`}>
            <NumberField label="Tilt" value={round(tilt)} unit="°" min={0} max={180} step={5} onCommit={(v) => set({ tilt: v, turn })} />
            <NumberField label="Turn" value={round(turn)} unit="°" min={-360} max={360} step={5} onCommit={(v) => set({ tilt, turn: v })} />
            {canPointAt(light) && (
                <button
                    type="button"
                    class="toggle"
                    aria-pressed={aiming}
                    title="Then click in the picture what it is to point at (A)"
                    onClick={() => (app.lamps.aiming.value = aiming ? null : light.id)}
                >
                    Point at…
                </button>
            )}
        </div>
    );
}

const round = (degrees: number): number => Number(degrees.toFixed(1)) + 0;

/** Lamps of one group are dimmed together; one that there is already can be chosen. */
function Group({ light }: { light: SceneRecord }) {
    const app = useApp();
    const listId = useId();
    const group = stringOr(light.group, '');
    const names = [...new Set(app.scene.lamps.value.map((id) => stringOr(app.scene.peek(id)?.group, '')))].filter((n) => n !== '').sort();
    const commit = (input: HTMLInputElement): void => {
        const name = input.value.trim().replace(/[^A-Za-z0-9_.:/-]+/g, '-').slice(0, 64);
        input.value = name;
        if (name !== group) app.lamps.setGroup(light.id, name);
    };
    return (
        <label class="group-field">
            <span class="field-label">Group</span>
            <input
                key={group}
                type="text"
                aria-label={`${light.id} group`}
                placeholder="none"
                spellcheck={false}
                autocomplete="off"
                maxLength={64}
                list={listId}
                defaultValue={group}
                onBlur={(e) => commit(e.currentTarget)}
                onKeyDown={(e) => e.key === 'Enter' && commit(e.currentTarget)}
            />
            <datalist id={listId}>
                {names.map((name) => (
                    <option key={name} value={name} />
                ))}
            </datalist>
        </label>
    );
}

function Actions({ light }: { light: SceneRecord }) {
    const app = useApp();
    const rows = useSignal(false);
    return (
        <>
            <div class="actions">
                <button type="button" class="button" title="Ctrl + D" onClick={() => void app.lamps.duplicate(light.id)}>
                    Copy
                </button>
                {light.type === 'light' && isPlaced(light) && (light.kind !== 'ies' || light.asset) && (
                    <button type="button" class="button" aria-expanded={rows.value} title="Copies of it in columns and rows" onClick={() => (rows.value = !rows.value)}>
                        Rows…
                    </button>
                )}
                <button type="button" class="button" title="Delete" aria-label={`Remove ${light.id}`} onClick={() => void app.lamps.remove(light.id)}>
                    Remove
                </button>
            </div>
            {rows.value && <ArrayForm light={light} onDone={() => (rows.value = false)} />}
        </>
    );
}
