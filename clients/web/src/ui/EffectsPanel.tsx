import { fixed, percent, si } from '../lib/format';
import { sharesOf, type Effect } from '../state/meter';
import { FORCES, type Force } from '../state/view';
import { useApp } from './context';

/** What the last frame was made of: what the scene does not call for is listed too, with the reason, and costs nothing. */
export function EffectsPanel() {
    const app = useApp();
    const effects = app.meter.server.value?.effects ?? [];
    if (effects.length === 0) return null;
    return (
        <section class="section effects" aria-labelledby="effects-title">
            <header class="section-head">
                <h2 id="effects-title">Effects</h2>
                <AllAutomatic />
            </header>
            <Missing />
            <p class="hint">What each part of the light took in the last frame; a bar is its part of the time.</p>
            <table>
                <caption class="visually-hidden">What each effect cost in the last frame, and why it was needed</caption>
                <thead>
                    <tr>
                        <th scope="col">Effect, and why</th>
                        <th scope="col" title="Parts of the picture, and samples of them, in which it was computed">
                            Tiles
                        </th>
                        <th scope="col" title="Rays traced for it in the last frame">
                            Rays
                        </th>
                        <th scope="col" title="Processor time that it took in the last frame, of all threads together">
                            CPU ms
                        </th>
                    </tr>
                </thead>
                {effects.map((e) => (
                    <Row key={e.name} effect={e} share={sharesOf(effects).get(e.name) ?? 0} />
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

/** share: of the processor time of all effects. */
function Row({ effect: e, share }: { effect: Effect; share: number }) {
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
                        <td title={`${percent(share)} of the time of all effects`}>{fixed(e.ms, 1)}</td>
                    </>
                )}
            </tr>
            <tr>
                <td colSpan={4}>
                    {!idle && <span class="effect-share" style={{ '--share': share.toFixed(3) }} aria-hidden="true" />}
                    <div class="effect-why">
                        <small>{e.on && !e.served ? `left out by this method; ${e.why}` : e.why}</small>
                        <Forcing name={e.name} />
                    </div>
                </td>
            </tr>
        </tbody>
    );
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
