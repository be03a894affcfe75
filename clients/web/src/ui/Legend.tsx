import { useSignal } from '@preact/signals';
import { number, toError } from '../lib/format';
import { placeOn, type OverlayLegend, type Scale } from '../state/frame_meter';
import { isOfLight, OVERLAYS, type FalseColour, type OverlayName } from '../state/view';
import { Choice } from './Choice';
import { useApp } from './context';
import { NumberField } from './NumberField';

/** One sentence each: what the map shows. */
const WHAT: Record<OverlayName, string> = {
    none: '',
    luminance: 'How bright each place is seen from here.',
    illuminance: 'How much light falls on each surface, whatever it is made of.',
    error: 'How far the picture may be off, over the light around.',
    shapes: '',
    guidance_soft_shadow: 'How often samples of soft shadows were refined.',
    guidance_indirect_diffuse: 'How often samples of indirect light were refined.',
    guidance_media: 'How often samples of media were refined.',
};

/** What the colours of the map over the picture mean. */
export function Legend() {
    const app = useApp();
    const { overlay } = app.view.settings.value;
    const legend = app.meter.server.value?.legend;
    if (overlay === 'none' || overlay === 'shapes') return null;
    return (
        <aside class="legend" aria-label="Legend">
            <header>
                <b>{OVERLAYS[overlay]}</b>
                <button type="button" class="button" onClick={() => app.view.change({ overlay: 'none' })}>
                    Hide
                </button>
            </header>
            <p>{legend ? WHAT[overlay] : <NoMap overlay={overlay} />}</p>
            {isOfLight(overlay) && <Value />}
            {legend && (legend.scale?.smooth ? <Bar legend={legend} scale={legend.scale} /> : <Classes legend={legend} />)}
            {isOfLight(overlay) && <Options legend={legend ?? null} />}
        </aside>
    );
}

const unitInWords = (unit: string): string => unit.replace('m2', 'm²');

/** Read off the picture, without a click. */
function Value() {
    const readout = useApp().reader.readout.value;
    const { middle, unit, value, error } = readout ?? { middle: true, unit: '', value: null, error: null };
    return (
        <dl class="legend-value">
            <dt>{middle ? 'In the middle' : 'Under the pointer'}</dt>
            <dd>
                {value === null ? '–' : `${number(toError(value, error ?? 0))} `}
                {value !== null && <small>{unitInWords(unit)}</small>}
                {value !== null && error !== null && <small> ± {number(Number(error.toPrecision(1)))}</small>}
            </dd>
        </dl>
    );
}

/** Limits stand between the colours that they part; the greatest is at the top. */
function Classes({ legend }: { legend: OverlayLegend }) {
    const { unit, colors, limits } = legend;
    const percent = unit === 'relative';
    const text = (i: number) => {
        if (i === 0) return `below ${inUnit(limits[0]!, percent)}`;
        return i === limits.length ? `from ${inUnit(limits[i - 1]!, percent)}` : inUnit(limits[i - 1]!, percent);
    };
    return (
        <ol class="legend-classes" aria-label={percent ? 'in percent' : `in ${unit}`}>
            {colors.map((color, i) => (
                <li key={color}>
                    <i style={{ background: color }} aria-hidden="true" />
                    {text(i)}
                    {!percent && i === limits.length && ` ${unitInWords(unit)}`}
                </li>
            ))}
        </ol>
    );
}

/** Colours that change evenly, with round values beside them. */
function Bar({ legend, scale }: { legend: OverlayLegend; scale: Scale }) {
    const { colors, limits, unit } = legend;
    return (
        <div class="legend-bar">
            <i style={{ background: `linear-gradient(to top, ${colors.join(', ')})` }} aria-hidden="true" />
            <ol aria-label={`in ${unit}`}>
                {limits.map((limit, i) => (
                    <li key={limit} style={{ bottom: `${(100 * placeOn(scale, limit)).toFixed(2)}%` }}>
                        {inUnit(limit, false)}
                        {i === limits.length - 1 && ` ${unitInWords(unit)}`}
                    </li>
                ))}
            </ol>
        </div>
    );
}

const SCALES: [string, string][] = [
    ['log', 'Logarithmic'],
    ['linear', 'Linear'],
];
const COLOURS: [string, string][] = [
    ['steps', 'In steps'],
    ['smooth', 'Smooth'],
];
const LINES: [string, string][] = [
    ['off', 'Off'],
    ['on', 'On'],
    ['only', 'Only'],
];
const PALETTES: [string, string][] = [
    ['even', 'Even'],
    ['spectrum', 'Spectrum'],
];
const PALETTE_TITLES = new Map([
    ['even', 'Lighter is more: also for eyes that confuse hues'],
    ['spectrum', 'From blue by green to red'],
]);
/** Of a scale in decades that was to begin at 0. */
const LEAST = 0.001;
/** LUM_LIMIT_FALSE_COLOR */
const MOST = 1e12;

/** How the map is drawn. */
function Options({ legend }: { legend: OverlayLegend | null }) {
    const app = useApp();
    const open = useSignal(false);
    const wanted = app.view.settings.value.falseColour;
    const set = (change: Partial<FalseColour>): void => app.view.change({ falseColour: { ...wanted, ...change } });
    const scaleTo = (scale: FalseColour['scale']): void => set({ scale, min: scale === 'log' && wanted.min === 0 ? null : wanted.min });
    return (
        <div class="legend-options">
            <button type="button" class="button" aria-expanded={open.value} onClick={() => (open.value = !open.value)}>
                Scale and lines
            </button>
            {open.value && (
                <div class="choices">
                    <Choice label="Scale" value={wanted.scale} options={SCALES} onChange={(v) => scaleTo(v as FalseColour['scale'])} />
                    <Choice label="Colours" value={wanted.smooth ? 'smooth' : 'steps'} options={COLOURS} onChange={(v) => set({ smooth: v === 'smooth' })} />
                    <Choice label="Lines" value={wanted.lines} options={LINES} onChange={(v) => set({ lines: v as FalseColour['lines'] })} />
                    <Choice label="Palette" value={wanted.palette} options={PALETTES} titles={PALETTE_TITLES} onChange={(v) => set({ palette: v as FalseColour['palette'] })} />
                    {legend?.scale && <Range wanted={wanted} scale={legend.scale} unit={unitInWords(legend.unit)} set={set} />}
                </div>
            )}
        </div>
    );
}

/** Held: the scale stays while lamps are dimmed, and pictures can be compared. */
function Range({ wanted, scale, unit, set }: { wanted: FalseColour; scale: Scale; unit: string; set(change: Partial<FalseColour>): void }) {
    const held = wanted.min !== null || wanted.max !== null;
    const min = wanted.min ?? scale.min;
    const max = wanted.max ?? scale.max;
    return (
        <>
            <NumberField label="From" unit={unit} min={wanted.scale === 'log' ? LEAST : 0} max={max * 0.999} value={round(min)} onCommit={(v) => set({ min: v, max })} />
            <NumberField label="To" unit={unit} min={Math.max(LEAST, min * 1.001)} max={MOST} value={round(max)} onCommit={(v) => set({ min, max: v })} />
            <button type="button" class="toggle" aria-pressed={held} title="The scale stays as it is while light changes" onClick={() => set(held ? { min: null, max: null } : { min, max })}>
                Hold this range
            </button>
        </>
    );
}

const round = (v: number): number => Number(v.toPrecision(6));

function inUnit(value: number, percent: boolean): string {
    return percent ? `${Number((100 * value).toPrecision(3))} %` : number(value);
}

function NoMap({ overlay }: { overlay: OverlayName }) {
    const server = useApp().meter.server.value;
    if (overlay === 'error') return <>Not known yet: it is measured while the picture rests.</>;
    if (isOfLight(overlay)) return <>The picture is black.</>;
    const effect = server?.effects.find((e) => `guidance_${e.name}` === overlay);
    return effect && !effect.on ? (
        <>Nothing to refine: the effect is off.</>
    ) : (
        <>{server?.method ?? 'This method'} makes no such map. Methods that sample adaptively do, like ais.</>
    );
}
