import { useComputed } from '@preact/signals';
import { fixed, number } from '../lib/format';
import { kelvinScale, linearScale } from '../lib/scale';
import { stringOr } from '../protocol/types';
import { kelvinOfAll } from '../state/lights';
import { SNAP_LIMITS } from '../state/snap';
import { OVERLAYS, RESOLUTIONS, STREAMS, type OverlayName, type Resolution, type Stream } from '../state/view';
import { Choice } from './Choice';
import { useApp } from './context';
import { CopyLink, LinkByHand } from './CopyLink';
import { NumberField } from './NumberField';
import { SavePicture } from './SavePicture';
import { Slider } from './Slider';

/** EV100: higher is darker, so the slider runs the other way and its right end is bright, as people expect. */
const EXPOSURE = linearScale(18, -4, 10);
const [LEAST_K, MOST_K] = [1800, 12000];
const BALANCE = kelvinScale(LEAST_K, MOST_K);
/** What a picture without balance takes for white, and what most lamps need where none says what its light is. */
const DAYLIGHT_K = 6504;
const LAMP_K = 3000;
const TONE_MAPS: [string, string][] = [
    ['agx', 'AgX'],
    ['aces', 'ACES'],
    ['reinhard', 'Reinhard'],
    ['none', 'None (clip)'],
];

/** How this client looks at the scene. Nothing here changes what others see. */
export function ViewPanel() {
    const app = useApp();
    const settings = app.view.settings.value;
    const render = app.scene.record('render');
    const cameras = app.scene.list('camera').value;
    return (
        <section class="section" aria-labelledby="view-title">
            <header class="section-head">
                <h2 id="view-title">Picture</h2>
                <CopyLink />
            </header>
            <LinkByHand />
            <Exposure />
            <WhiteBalance />
            <div class="choices">
                <Choice
                    label="Tone map"
                    value={settings.toneMap ?? stringOr(render?.tone_map, 'agx')}
                    options={TONE_MAPS}
                    onChange={(toneMap) => app.view.change({ toneMap })}
                />
                <Choice
                    label="Method"
                    value={settings.method ?? app.meter.server.value?.method ?? ''}
                    options={app.methods.value.map((m) => [m.name, m.name])}
                    titles={new Map(app.methods.value.map((m) => [m.name, m.summary]))}
                    onChange={(method) => app.view.change({ method })}
                />
                <Choice
                    label="Resolution"
                    value={settings.resolution}
                    options={Object.entries(RESOLUTIONS).map(([key, r]) => [key, r.label])}
                    onChange={(r) => app.view.change({ resolution: r as Resolution })}
                />
                <Choice
                    label="Stream"
                    value={settings.stream}
                    options={Object.entries(STREAMS).map(([key, s]) => [key, s.label])}
                    onChange={(s) => app.view.change({ stream: s as Stream })}
                />
                <Choice
                    label="Map"
                    value={settings.overlay}
                    options={Object.entries(OVERLAYS)}
                    onChange={(map) => app.view.change({ overlay: map as OverlayName })}
                />
                {cameras.length > 1 && (
                    <Choice
                        label="Go to camera"
                        value=""
                        options={[['', 'Choose…'], ...cameras.map((id): [string, string] => [id, id])]}
                        onChange={(id) => id && app.goToCamera(id)}
                    />
                )}
            </div>
            <SnapFields />
            <SavePicture />
        </section>
    );
}

/** Of what is moved and turned by hand: where Ctrl is held, or the switch above is on. */
function SnapFields() {
    const { snap } = useApp();
    const { grid, angle } = SNAP_LIMITS;
    return (
        <div class="fields snap-fields" role="group" aria-label="Snapping of what is moved and turned: with X, or while Ctrl is held">
            <NumberField label="Snap to" unit="m" {...grid} step={0.05} value={snap.gridM.value} onCommit={(v) => snap.set(v, snap.angleDeg.value)} />
            <NumberField label="Snap angles to" unit="°" {...angle} step={5} value={snap.angleDeg.value} onCommit={(v) => snap.set(snap.gridM.value, v)} />
        </div>
    );
}

function Exposure() {
    const app = useApp();
    const { auto, ev } = app.exposure.value;
    const set = (v: { auto: boolean; ev: number }): void => app.view.change({ exposure: v });
    return (
        <div class="exposure">
            <div class="line">
                <span class="field-label">Exposure</span>
                <output>
                    {fixed(ev, 1)} <small>EV</small>
                </output>
                <button type="button" class="toggle" aria-pressed={auto} onClick={() => set({ auto: !auto, ev })}>
                    Auto
                </button>
            </div>
            <Slider
                label="Exposure"
                scale={EXPOSURE}
                value={ev}
                spoken={`${fixed(ev, 1)} EV${auto ? ', automatic' : ''}`}
                onInput={(v) => set({ auto: false, ev: v })}
                onEnd={() => {}}
            />
        </div>
    );
}

function WhiteBalance() {
    const app = useApp();
    const kelvin = app.view.settings.value.whiteBalance;
    const ofLamps = useComputed(() => {
        const known = kelvinOfAll(app.scene.lamps.value.map((id) => app.scene.record(id)).filter((lamp) => lamp !== undefined));
        return known === null ? null : Math.min(MOST_K, Math.max(LEAST_K, known));
    }).value; // a lamp that moves, or is dimmed with all others, draws nothing anew
    const set = (whiteBalance: number | null): void => app.chooseWhite(whiteBalance);
    return (
        <div class="exposure">
            <div class="line">
                <span class="field-label">White balance</span>
                <output class={kelvin === null ? 'is-idle' : ''}>
                    {number(kelvin ?? DAYLIGHT_K)} <small>K</small>
                </output>
                {ofLamps !== null && (
                    <button
                        type="button"
                        class="toggle is-quiet"
                        aria-label="White balance of the lamps"
                        title="As eyes adapt to the room: the mean light of its lamps is white"
                        aria-pressed={kelvin === ofLamps}
                        onClick={() => set(ofLamps)}
                    >
                        Lamps
                    </button>
                )}
                <button
                    type="button"
                    class="toggle is-quiet"
                    aria-label="White balance off"
                    aria-pressed={kelvin === null}
                    onClick={() => set(kelvin === null ? (ofLamps ?? LAMP_K) : null)}
                >
                    Off
                </button>
            </div>
            <Slider
                class={`kelvin ${kelvin === null ? 'is-idle' : ''}`}
                label="White balance"
                scale={BALANCE}
                value={kelvin ?? DAYLIGHT_K}
                spoken={kelvin === null ? 'off' : `${kelvin} kelvin is white`}
                onInput={set}
                onEnd={() => {}}
            />
        </div>
    );
}
