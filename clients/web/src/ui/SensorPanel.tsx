import { fixed, number, toError } from '../lib/format';
import { numberOr, stringOr, type SceneRecord } from '../protocol/types';
import { NOT_TO_MEASURE } from '../state/role';
import { daylightInWords, modellingInWords, pointsInWords, QUANTITIES, stateOf, unknownInWords, verdict, worstInWords, worstPlaceInWords, gazeOf, type Power, type SensorReading, type Target, type Value } from '../state/sensors';
import { orbitFromPose } from '../view/camera';
import { useApp } from './context';
import { Choice } from './Choice';
import { Editing } from './Editing';
import { Icon } from './Icon';
import { NumberField } from './NumberField';

/** Light meters of the scene, and whether what was asked of the light is met. */
export function SensorPanel() {
    const app = useApp();
    const ids = app.scene.list('sensor').value;
    const worst = worstInWords(app.sensors.readings.value, ids, (id) => stringOr(app.scene.peek(id)?.name, id));
    return (
        <section class="section" aria-labelledby="sensors-title">
            <header class="section-head">
                <h2 id="sensors-title">Measure</h2>
                <Editing>
                    <button type="button" class="toggle at-end" aria-label="Add work plane" onClick={() => void app.sensors.addWorkPlane()}>
                        {ids.length > 0 ? 'Add' : 'Add work plane'}
                    </button>
                    <button
                        type="button"
                        class="toggle"
                        aria-label="Add observer"
                        title="Who stands where the view is, and looks as it does: UGR, and DGP by day"
                        onClick={() => void app.sensors.addObserver()}
                    >
                        Observer
                    </button>
                    <button
                        type="button"
                        class="toggle"
                        aria-label="Add glare grid"
                        title="Eyes 1.2 m above the whole floor, looking all around: UGR of each, and where it is worst"
                        onClick={() => void app.sensors.addEyes()}
                    >
                        Glare
                    </button>
                </Editing>
            </header>
            {app.mayMeasure.value && (
                <div class="sensor-tools">
                    {ids.length > 0 && (
                        <>
                            <button
                                type="button"
                                class="toggle"
                                aria-pressed={app.sensors.pointsShown.value}
                                title="Draws their points in the picture, with what each has: ● as much as is wanted, ○ less, ✕ less than the least may be"
                                onClick={() => (app.sensors.pointsShown.value = !app.sensors.pointsShown.value)}
                            >
                                Points
                            </button>
                            <button type="button" class="toggle" title="Saves all points with their standard errors, as sensors.csv" onClick={() => void app.downloads.csv()}>
                                CSV
                            </button>
                        </>
                    )}
                    <button
                        type="button"
                        class="toggle"
                        aria-busy={app.downloads.reporting.value}
                        aria-disabled={app.downloads.reporting.value}
                        title="Saves a page to print: results, pictures, plans of the points, luminaires"
                        onClick={() => void app.downloads.report()}
                    >
                        {app.downloads.reporting.value ? 'Report…' : 'Report'}
                    </button>
                </div>
            )}
            {app.downloads.reporting.value && <p class="hint">Report: {app.downloads.reportStage.value || 'waiting for its turn'}</p>}
            {ids.length > 0 && !app.mayMeasure.value && <p class="hint">{NOT_TO_MEASURE}</p>}
            {ids.length === 0 && <p class="hint">A work plane shows the mean illuminance and its uniformity while you move lamps.</p>}
            {worst && <p class="hint">{worst}</p>}
            <ul class="light-list">
                {ids.map((id) => (
                    <Sensor key={id} id={id} />
                ))}
            </ul>
        </section>
    );
}

function Sensor({ id }: { id: string }) {
    const app = useApp();
    const record = app.scene.record(id);
    if (!record) return null;
    const reading = app.sensors.readings.value.get(id);
    const current = app.online.value && reading !== undefined && reading.rev >= app.scene.rev.value;
    const lit = reading !== undefined && reading.kind !== 'observer' && reading.quantity !== 'ugr';
    return (
        <li class="light sensor">
            <div class="light-head">
                <span class="light-name">{stringOr(record.name, id)}</span>
                <Editing>
                    <button type="button" class="icon-button" aria-label={`Remove ${id}`} title="Remove" onClick={() => app.sensors.remove(id)}>
                        <Icon name="close" />
                    </button>
                </Editing>
            </div>
            <p class="kind">{stateOf(reading, current)}</p>
            {reading && (
                <dl class={`sensor-values ${current ? '' : 'is-old'}`}>
                    {lit && <Row name="Mean" value={reading.em} unit="lx" target={reading.targets.em} />}
                    {lit && reading.points > 1 && <Row name="Least" value={reading.emin} unit="lx" />}
                    {lit && reading.points > 1 && <Row name="Uniformity" value={reading.uo} unit="" target={reading.targets.uo} />}
                    {reading.modelling && <Row name="Modelling" value={reading.modelling} unit="" digits={3} />}
                    {!lit && <Row name={reading.quantity === 'ugr' ? 'Worst UGR' : 'UGR'} value={reading.ugr} unit="" target={reading.targets.ugr} />}
                    {reading.kind === 'observer' && <Row name="DGP" value={reading.dgp} unit="" digits={3} target={reading.targets.dgp} />}
                </dl>
            )}
            {reading?.worst && <Worst reading={reading} />}
            {reading?.modelling && <p class="hint">{modellingInWords(reading)}</p>}
            {reading?.dgp && <p class="hint">{daylightInWords(reading)}</p>}
            {reading?.power && <PowerOf power={reading.power} />}
            {reading && <Points record={record} reading={reading} />}
            <Editing>
                <Wanted record={record} />
            </Editing>
        </li>
    );
}

/** Where an eye is glared most, and what it sees. */
function Worst({ reading }: { reading: SensorReading }) {
    const { view } = useApp();
    const { worst } = reading;
    if (!worst) return null;
    return (
        <p class="hint">
            {worstPlaceInWords(reading)}{' '}
            <button type="button" class="toggle" title="The view goes there, and looks so" onClick={() => view.moveTo(orbitFromPose(gazeOf(worst)))}>
                See it
            </button>
        </p>
    );
}

/** What the lamps take, over the room's floor. */
function PowerOf({ power }: { power: Power }) {
    const unknown = unknownInWords(power);
    return (
        <>
            <p class="hint">
                Power {number(power.watts)} W, {fixed(power.perM2, 2)} W/m² over {number(power.floorM2)} m²
                {power.per100Lx !== null && `, ${fixed(power.per100Lx, 2)} W/m² for each 100 lx`}
            </p>
            {unknown && <p class="hint">{unknown}</p>}
        </>
    );
}

/** What the picture shows, in words. */
function Points({ record, reading }: { record: SceneRecord; reading: SensorReading }) {
    const text = pointsInWords(record, reading);
    return text && <p class="hint">{text}</p>;
}

/** Null: there is none, as of a point inside a wall, or of an eye that sees no lamp. */
function Row({ name, value, unit, target, digits = 2 }: { name: string; value: Value | null; unit: string; target?: Target; digits?: number }) {
    const text = !value ? '–' : value.value < 10 ? fixed(value.value, digits) : number(toError(value.value, value.stderr));
    const error = value && Number.isFinite(value.stderr) ? ` ± ${value.stderr < 1 ? fixed(value.stderr, digits) : number(Number(value.stderr.toPrecision(2)))}` : '';
    return (
        <>
            <dt>{name}</dt>
            <dd>
                {text}
                <small>{error}</small> {value ? unit : ''}
            </dd>
            <dd class={target ? (target.passes ? 'passes' : 'misses') : ''}>
                {target && (
                    <>
                        <span aria-hidden="true">{target.passes ? '✓' : '✗'} </span>
                        {verdict(target)}
                    </>
                )}
            </dd>
        </>
    );
}

/** Zero: nothing is asked. */
function Wanted({ record }: { record: SceneRecord }) {
    const { edits, sensors } = useApp();
    const set = (path: string, v: number): void => edits.setOnce(record.id, path, v > 0 ? v : null);
    if (record.kind === 'observer')
        return (
            <div class="fields">
                <NumberField label="UGR wanted, at most" unit="" min={0} max={100} value={numberOr(record.target_ugr, 0)} onCommit={(v) => set('/target_ugr', v)} />
                <NumberField label="DGP wanted, at most" unit="" min={0} max={1} value={numberOr(record.target_dgp, 0)} onCommit={(v) => set('/target_dgp', v)} />
            </div>
        );
    const measures = <Choice label="Measures" value={stringOr(record.quantity, 'plane')} options={QUANTITIES} onChange={(v) => sensors.measure(record, v)} />;
    if (record.quantity === 'ugr')
        return (
            <div class="fields">
                {measures}
                <NumberField label="UGR wanted, at most" unit="" min={0} max={100} value={numberOr(record.target_ugr, 0)} onCommit={(v) => set('/target_ugr', v)} />
                <NumberField label="Lines of sight" unit="" min={1} max={64} value={numberOr(record.directions, 8)} onCommit={(v) => edits.setOnce(record.id, '/directions', Math.round(v))} />
            </div>
        );
    return (
        <div class="fields">
            {measures}
            <NumberField label="Mean wanted" unit="lx" min={0} max={1e9} value={numberOr(record.target_lx, 0)} onCommit={(v) => set('/target_lx', v)} />
            {record.kind !== 'point' && (
                <NumberField label="Uniformity wanted" unit="" min={0} max={1} value={numberOr(record.target_uo, 0)} onCommit={(v) => set('/target_uo', v)} />
            )}
        </div>
    );
}
