import { fixed, percent, si } from '../lib/format';
import { sharesOf, type Effect, type Shares } from '../state/frame_meter';
import { FORCES, type Force } from '../state/view';
import { useApp } from './context';

/** What the last frame was made of: what the scene does not call for is listed too, with the reason, and costs nothing. */
export function EffectsPanel() {
    const app = useApp();
    const effects = app.meter.server.value?.effects ?? [];
    if (effects.length === 0) return null;
    const shares = sharesOf(effects);
    const noisy = app.method.value?.addsSamples ?? false;
    return (
        <section class="section effects" aria-labelledby="effects-title">
            <header class="section-head">
                <h2 id="effects-title">Effects</h2>
                <AllAutomatic />
            </header>
            <Missing />
            <p class="hint">
                What each part of the light took in the last frame, <span class="key-time">time</span>
                {noisy ? (
                    <>
                        , and how much of the <span class="key-noise">noise</span> is of it: more samples help most where that is long.
                    </>
                ) : (
                    '.'
                )}
            </p>
            <table>
                <caption class="visually-hidden">What each effect cost in the last frame, and why it was needed</caption>
                <thead>
                    <tr>
                        <th scope="col">Effect</th>
                        <th scope="col" title="Parts of the picture, and samples of them, in which it was computed">
                            Tiles
                        </th>
                        <th scope="col" title="Rays traced for it in the last frame">
                            Rays
                        </th>
                        <th scope="col" title="Processor time that it took in the last frame, of all threads together">
                            CPU ms
                        </th>
                        {noisy && (
                            <th scope="col" title="Of its light in the samples of this picture so far: root mean square, by the mean luminance of all">
                                Noise
                            </th>
                        )}
                    </tr>
                </thead>
                {effects.map((e) => (
                    <Row key={e.name} effect={e} shares={shares.get(e.name)!} noisy={noisy} />
                ))}
            </table>
            <Cache />
        </section>
    );
}

/** Light that is in no picture, whatever the method; what to do about it when pointed at. */
function Missing() {
    const missing = useApp().meter.server.value?.missing;
    return missing ? (
        <p class="missing" title={missing.mend}>
            {missing.why}
        </p>
    ) : null;
}

/** What the frame had of the irradiance cache that all views share; nothing where the method keeps none. */
function Cache() {
    const cache = useApp().meter.server.value?.cache;
    if (!cache) return null;
    const parts: [string, number, string][] = [
        ['records', cache.records, 'Places where indirect light is known'],
        ['created', cache.created, 'New in the last frame'],
        ['updated', cache.updated, 'Known already, and renewed in part for what changed'],
        ['reused', cache.reused, 'Taken as they were'],
        ['removed', cache.removed, 'Dropped: too old, or where nothing is any more'],
    ];
    return (
        <div class="cache">
            <h3>Irradiance cache</h3>
            <dl>
                {parts.map(([name, n, title]) => (
                    <div key={name} title={title}>
                        <dt>{name}</dt>
                        <dd>{si(n)}</dd>
                    </div>
                ))}
            </dl>
        </div>
    );
}

const spoken = (name: string): string => name.replace(/_/g, ' ');

/** Path samples go through all of a pixel, so they smooth edges without a ray more. */
const ridesAlong = (e: Effect): boolean => e.name === 'antialias' && e.on && e.served;

/** noisy: there is a column for it. */
function Row({ effect: e, shares, noisy }: { effect: Effect; shares: Shares; noisy: boolean }) {
    const idle = e.rays === 0 && e.tiles === 0 && e.ms === 0;
    return (
        <tbody class={`effect ${e.on && e.served ? '' : 'is-off'}`}>
            <tr>
                <th scope="rowgroup">{spoken(e.name)}</th>
                {idle ? (
                    <td colSpan={3} class="effect-rays">
                        {ridesAlong(e) ? 'with the samples' : '0 rays'}
                    </td>
                ) : (
                    <>
                        <td>{si(e.tiles)}</td>
                        <td class="effect-rays">{si(e.rays)}</td>
                        <td title={`${percent(shares.time)} of the time of all effects`}>{fixed(e.ms, 1)}</td>
                    </>
                )}
                {noisy && <td>{e.noise ? percent(e.noise) : '–'}</td>}
            </tr>
            <tr>
                <td colSpan={noisy ? 5 : 4}>
                    {!idle && <Bar class="key-time" share={shares.time} />}
                    {shares.noise !== null && shares.noise > 0 && <Bar class="key-noise" share={shares.noise} />}
                    <div class="effect-why">
                        <small>{e.on && !e.served ? `left out by this method; ${e.why}` : e.why}</small>
                        <Forcing name={e.name} />
                    </div>
                </td>
            </tr>
        </tbody>
    );
}

/** The numbers are in the table. */
function Bar({ share, ...props }: { share: number; class: string }) {
    return <span class={`effect-share ${props.class}`} style={{ '--share': share.toFixed(3) }} aria-hidden="true" />;
}

const TITLES: Record<Force, string> = {
    auto: 'When the scene calls for it',
    off: 'Left out, for this view',
    on: 'Computed whether or not the scene calls for it, for this view',
};

function Forcing({ name }: { name: string }) {
    const app = useApp();
    const { effects } = app.view.settings.value;
    const now = effects[name] ?? 'auto';
    return (
        <div class="segmented forcing" role="group" aria-label={spoken(name)}>
            {FORCES.map((f) => (
                <button
                    key={f}
                    type="button"
                    title={TITLES[f]}
                    aria-label={`${spoken(name)} ${f}`}
                    aria-pressed={f === now}
                    onClick={() => app.view.change({ effects: { ...effects, [name]: f } })}
                >
                    {f}
                </button>
            ))}
        </div>
    );
}

/** The way back, as long as something is forced. */
function AllAutomatic() {
    const app = useApp();
    const { effects } = app.view.settings.value;
    if (Object.values(effects).every((f) => f === 'auto')) return null;
    const automatic = Object.fromEntries(Object.keys(effects).map((name) => [name, 'auto' as Force]));
    return (
        <button type="button" class="toggle at-end" onClick={() => app.view.change({ effects: automatic })}>
            All automatic
        </button>
    );
}
