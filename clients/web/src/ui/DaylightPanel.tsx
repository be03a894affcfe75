import { useSignal } from '@preact/signals';
import { useEffect, useMemo } from 'preact/hooks';
import { fixed, si } from '../lib/format';
import { Once } from '../lib/once';
import { linearScale } from '../lib/scale';
import { numberOr, stringOr, type SceneRecord } from '../protocol/types';
import { clockOf, DAY, daylightOf, localDate, newSky, newSun, SKIES, skyChange, switchOff, type Daylight } from '../state/daylight';
import { nameOf } from '../state/lights';
import { Choice } from './Choice';
import { useApp } from './context';
import { Editing } from './Editing';
import { NumberField } from './NumberField';
import { Slider } from './Slider';

const HOURS = linearScale(0, DAY, 60);

/** Sun and sky of the scene, and what of its light is in their way. */
export function DaylightPanel() {
    const app = useApp();
    const records = app.scene.list('light').value.map((id) => app.scene.record(id));
    const { sun, sky, replaced, doubled } = daylightOf(records.filter((r) => r !== undefined));
    const taken = (id: string): boolean => app.scene.peek(id) !== undefined;
    const add = (): void => {
        const ops = [...(sun ? [] : [newSun(taken, localDate(new Date()))]), ...(sky ? [] : [newSky(taken)])];
        void app.edits.transaction(ops);
    };
    return (
        <section class="section" aria-labelledby="daylight-title">
            <Editing>
                <header class="section-head">
                    <h2 id="daylight-title">Daylight</h2>
                    {!(sun && sky) && (
                        <button type="button" class="toggle at-end" onClick={add}>
                            {sun ? 'Add a sky' : sky ? 'Add a sun' : 'Add sun and sky'}
                        </button>
                    )}
                </header>
                {sky && (
                    <div class="fields">
                        <Choice
                            label="Sky"
                            value={String(numberOr(sky.cie_type, 12))}
                            options={SKIES}
                            onChange={(type) => void app.edits.transaction(skyChange(sky, sun, Number(type)))}
                        />
                    </div>
                )}
                {replaced.length > 0 && <p class="hint">The sky shines in place of {quoted(replaced)}.</p>}
                {sun && <Sun sun={sun} />}
                {doubled.length > 0 && (
                    <p class="hint">
                        Beside the sun {quoted(doubled)} {doubled.length > 1 ? 'shine' : 'shines'} from afar, too.{' '}
                        <button type="button" class="toggle" onClick={() => void app.edits.transaction(switchOff(doubled))}>
                            Switch {doubled.length > 1 ? 'them' : 'it'} off
                        </button>
                    </p>
                )}
                {(sun || sky) && <ReadOuts />}
            </Editing>
        </section>
    );
}

const quoted = (lights: readonly SceneRecord[]): string => lights.map((l) => `“${nameOf(l)}”`).join(', ');

function Sun({ sun }: { sun: SceneRecord }) {
    const { edits } = useApp();
    const hour = numberOr(sun.time_h, 12);
    const field = (path: string, label: string, unit: string, most: number, otherwise = 0) => (
        <NumberField
            label={label}
            unit={unit}
            min={-most}
            max={most}
            value={numberOr(sun[path], otherwise)}
            onCommit={(v) => edits.setOnce(sun.id, `/${path}`, v)}
        />
    );
    if (typeof sun.elevation_deg === 'number') return <p class="hint">The sun stands by azimuth and elevation.</p>;
    return (
        <>
            <div class="exposure">
                <div class="line">
                    <span class="field-label">Time</span>
                    <output>{clockOf(hour)}</output>
                </div>
                <Slider
                    label="Time of day"
                    scale={HOURS}
                    value={hour}
                    spoken={clockOf(hour)}
                    steps={{ arrow: 1 / 96, page: 1 / 24 }}
                    grid={1 / 1440}
                    onInput={(v) => edits.set(sun.id, '/time_h', v)}
                    onEnd={() => edits.endGesture()}
                />
            </div>
            <div class="fields">
                <label class="number">
                    <span class="number-label">Date</span>
                    <input
                        type="date"
                        aria-label="Date"
                        min="1900-01-01"
                        max="2100-12-31"
                        value={stringOr(sun.date, '')}
                        onChange={(e) => e.currentTarget.value && edits.setOnce(sun.id, '/date', e.currentTarget.value)}
                    />
                </label>
                {field('utc_offset_h', 'Ahead of UTC', 'h', 14)}
                <NumberField
                    label="Disc across"
                    unit="°"
                    min={0}
                    max={90}
                    value={numberOr(sun.diameter_deg, 0)}
                    onCommit={(v) => edits.setOnce(sun.id, '/diameter_deg', v)}
                />
            </div>
            <div class="fields">
                {field('latitude_deg', 'Latitude', '° N', 90)}
                {field('longitude_deg', 'Longitude', '° E', 180)}
                {field('north_deg', 'North turned', '°', 360)}
            </div>
        </>
    );
}

/** As the server tells them of the scene that it has now: asked again after each edit, and never twice at once. */
function ReadOuts() {
    const app = useApp();
    const now = useSignal<Daylight | null>(null);
    const rev = app.scene.rev.value;
    const ask = useMemo(
        () =>
            new Once(async () => {
                const told = await app.daylight();
                if (told) now.value = told;
            }),
        [app],
    );
    useEffect(() => void ask.run(), [rev]);
    const { sun, sky } = now.value ?? { sun: null, sky: null };
    return (
        <div class="cache">
            <dl>
                {sun && <Fact name="elevation" value={`${fixed(sun.elevation_deg, 1)}°`} title="Of the sun over the horizon" />}
                {sun && <Fact name="azimuth" value={`${fixed(sun.azimuth_deg, 1)}°`} title="Of the sun, from north by east" />}
                {sun && <Fact name="sun" value={`${si(sun.horizontal_lx)}lx`} title="On the open horizontal plane" />}
                {sky && <Fact name="sky" value={`${si(sky.horizontal_lx)}lx`} title="On the open horizontal plane" />}
            </dl>
        </div>
    );
}

function Fact({ name, value, title }: { name: string; value: string; title: string }) {
    return (
        <div title={title}>
            <dt>{name}</dt>
            <dd>{value}</dd>
        </div>
    );
}
