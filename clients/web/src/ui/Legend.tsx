import type { OverlayLegend } from '../state/meter';
import { OVERLAYS, type OverlayName } from '../state/view';
import { useApp } from './context';

/** One sentence each: what the map shows. */
const WHAT: Record<OverlayName, string> = {
    none: '',
    luminance: 'How bright each place is seen from here.',
    illuminance: 'How much light falls on each surface, whatever it is made of.',
    error: 'How far the picture may be off, over the light around.',
    guidance_soft_shadow: 'How often samples of soft shadows were refined.',
    guidance_indirect_diffuse: 'How often samples of indirect light were refined.',
    guidance_media: 'How often samples of media were refined.',
};

/** What the colours of the map over the picture mean. */
export function Legend() {
    const app = useApp();
    const { overlay } = app.view.settings.value;
    const legend = app.meter.server.value?.legend;
    if (overlay === 'none') return null;
    return (
        <aside class="legend" aria-label="Legend">
            <header>
                <b>{OVERLAYS[overlay]}</b>
                <button type="button" class="button" onClick={() => app.view.change({ overlay: 'none' })}>
                    Hide
                </button>
            </header>
            <p>{legend ? WHAT[overlay] : <NoMap overlay={overlay} />}</p>
            {legend && <Classes legend={legend} />}
        </aside>
    );
}

/** Limits stand between the colours that they part; the greatest is at the top. */
function Classes({ legend }: { legend: OverlayLegend }) {
    const { unit, colors, limits } = legend;
    const percent = unit === 'relative';
    const text = (i: number) => {
        if (i === 0) return `below ${number(limits[0]!, percent)}`;
        return i === limits.length ? `from ${number(limits[i - 1]!, percent)}` : number(limits[i - 1]!, percent);
    };
    return (
        <ol class="legend-classes" aria-label={percent ? 'in percent' : `in ${unit}`}>
            {colors.map((color, i) => (
                <li key={color}>
                    <i style={{ background: color }} aria-hidden="true" />
                    {text(i)}
                    {!percent && i === limits.length && ` ${unit.replace('m2', 'm²')}`}
                </li>
            ))}
        </ol>
    );
}

function number(value: number, percent: boolean): string {
    return percent ? `${Number((100 * value).toPrecision(3))} %` : `${Number(value.toPrecision(3))}`;
}

function NoMap({ overlay }: { overlay: OverlayName }) {
    const server = useApp().meter.server.value;
    if (overlay === 'error') return <>Not known yet: it is measured while the picture rests.</>;
    if (overlay === 'luminance' || overlay === 'illuminance') return <>The picture is black.</>;
    const effect = server?.effects.find((e) => `guidance_${e.name}` === overlay);
    return effect && !effect.on ? (
        <>Nothing to refine: the effect is off.</>
    ) : (
        <>{server?.method ?? 'This method'} makes no such map. Methods that sample adaptively do, like ais.</>
    );
}
