import { linearFromHex, swatch, unitLuminance } from '../lib/colour';
import { number } from '../lib/format';
import { kelvinScale } from '../lib/scale';
import type { Vec3 } from '../lib/vec';
import type { Json } from '../protocol/rpc';
import { numberOr, stringOr, type SceneRecord } from '../protocol/types';
import { asInModel, colourOf, emitsOf, intensityOf, isAdjusted, isPlaced, kindOf } from '../state/lights';
import { anchorOf } from '../state/placement';
import { useApp } from './context';
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
            <p class="kind">
                {kindOf(light)} light{light.group ? ` in group ${stringOr(light.group, '')}` : ''}
            </p>
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
