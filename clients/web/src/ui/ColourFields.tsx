import { signal } from '@preact/signals';
import { linearFromHex, linearFromXy, swatch, unitLuminance, xyOf } from '../lib/colour';
import { number } from '../lib/format';
import { kelvinScale } from '../lib/scale';
import type { Vec3 } from '../lib/vec';
import type { Json } from '../protocol/rpc';
import type { Op, SceneRecord } from '../protocol/types';
import { colourOf } from '../state/lights';
import { common, fieldOfAll } from '../state/many';
import { useApp } from './context';
import { NumberField } from './NumberField';
import { Slider } from './Slider';

const KELVIN = kelvinScale(1800, 12000);
const USUAL_K = 4000;
const PRESETS: [string, number][] = [
    ['Candle', 1900],
    ['Tungsten', 2700],
    ['Halogen', 3000],
    ['Neutral', 4000],
    ['Daylight', 5600],
    ['Overcast', 6500],
];

/** How who works here likes to say a colour that is no temperature. */
const byXy = signal(false);

/** The colour of the light of one lamp, or of several. */
export function ColourFields({ lights }: { lights: readonly SceneRecord[] }) {
    const app = useApp();
    const colours = lights.map(colourOf);
    const { linear } = colours[0]!;
    const byTemperature = colours.every((c) => c.kelvin !== null);
    const kelvin = common(colours.map((c) => c.kelvin));
    const name = lights.length === 1 ? lights[0]!.id : 'Selected lamps';
    const toColour = (light: SceneRecord): Op => ({ op: 'set', id: light.id, path: '', value: { cct_k: null, color: [...unitLuminance(colourOf(light).linear)] } });
    const setMode = (temperature: boolean, xy = false): void => {
        byXy.value = xy;
        if (temperature !== byTemperature) void app.edits.transaction(temperature ? fieldOfAll(lights, '/cct_k', USUAL_K) : lights.map(toColour));
    };
    const mode = (label: string, pressed: boolean, onClick: () => void) => (
        <button type="button" aria-pressed={pressed} onClick={onClick}>
            {label}
        </button>
    );
    return (
        <div class="colour">
            <div class="segmented" role="group" aria-label={`${name} colour mode`}>
                {mode('Temperature', byTemperature, () => setMode(true))}
                {mode('Colour', !byTemperature && !byXy.value, () => setMode(false))}
                {mode('xy', !byTemperature && byXy.value, () => setMode(false, true))}
                <span class="swatch" style={{ '--lamp': swatch(linear) }} />
            </div>
            {byTemperature ? (
                <Temperature name={name} lights={lights} kelvin={kelvin} first={colours[0]!.kelvin!} />
            ) : byXy.value ? (
                <Chromaticity name={name} lights={lights} linears={colours.map((c) => c.linear)} />
            ) : (
                <Picker lights={lights} linear={linear} />
            )}
        </div>
    );
}

interface TemperatureProps {
    name: string;
    lights: readonly SceneRecord[];
    /** null: they differ. */
    kelvin: number | null;
    first: number;
}

function Temperature({ name, lights, kelvin, first }: TemperatureProps) {
    const app = useApp();
    const set = (k: number): void => {
        for (const l of lights) app.edits.set(l.id, '/cct_k', k);
    };
    const once = (k: number): void => {
        app.edits.endGesture();
        set(k);
        app.edits.endGesture();
    };
    return (
        <>
            <div class="slider-line">
                <Slider
                    class="kelvin"
                    label={`${name} colour temperature`}
                    scale={KELVIN}
                    value={kelvin ?? first}
                    spoken={kelvin === null ? 'mixed' : `${kelvin} kelvin`}
                    onInput={set}
                    onEnd={() => app.edits.endGesture()}
                />
                <output>
                    {kelvin === null ? 'mixed' : number(kelvin)} {kelvin !== null && <small>K</small>}
                </output>
            </div>
            <div class="presets" role="group" aria-label="Colour temperature presets">
                {PRESETS.map(([label, k]) => (
                    <button key={k} type="button" title={`${k} K`} aria-pressed={k === kelvin} onClick={() => once(k)}>
                        {label}
                    </button>
                ))}
            </div>
        </>
    );
}

function Picker({ lights, linear }: { lights: readonly SceneRecord[]; linear: Vec3 }) {
    const app = useApp();
    return (
        <label class="picker">
            <span>Light colour</span>
            <input
                type="color"
                value={swatch(linear)}
                onInput={(e) => {
                    const colour = [...unitLuminance(linearFromHex(e.currentTarget.value))] as Json;
                    for (const l of lights) app.edits.set(l.id, '/color', colour);
                }}
                onChange={() => app.edits.endGesture()}
            />
        </label>
    );
}

/** As a data sheet tells it: CIE 1931. */
function Chromaticity({ name, lights, linears }: { name: string; lights: readonly SceneRecord[]; linears: readonly Vec3[] }) {
    const app = useApp();
    const told = linears.map(xyOf);
    const set = (axis: 0 | 1, v: number): void => {
        const wanted = told.map(([x, y]) => (axis === 0 ? linearFromXy(v, y) : linearFromXy(x, v)));
        const ops = lights.map((l, i): Op => ({ op: 'set', id: l.id, path: '/color', value: [...wanted[i]!.linear] }));
        if (wanted.some((w) => w.outside)) app.toasts.info('That colour is outside of Rec. 709, which light has here: it is as near as its hue goes');
        void app.edits.transaction(ops);
    };
    const value = (axis: 0 | 1): number | null => {
        const all = common(told.map((xy) => xy[axis]));
        return all === null ? null : Number(all.toFixed(4));
    };
    return (
        <div class="fields" role="group" aria-label={`${name} CIE 1931 chromaticity`}>
            <NumberField label="x" value={value(0)} unit="" min={0.01} max={0.75} step={0.005} onCommit={(v) => set(0, v)} />
            <NumberField label="y" value={value(1)} unit="" min={0.01} max={0.85} step={0.005} onCommit={(v) => set(1, v)} />
        </div>
    );
}
