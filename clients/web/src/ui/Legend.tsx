import { OVERLAYS } from '../state/view';
import { useApp } from './context';

/** What the colours of the map over the picture mean. */
export function Legend() {
    const app = useApp();
    const { overlay } = app.view.settings.value;
    if (overlay === 'none') return null;
    const server = app.meter.server.value;
    const effect = server?.effects.find((e) => `guidance_${e.name}` === overlay);
    return (
        <aside class="legend" aria-label="Legend">
            <header>
                <b>{OVERLAYS[overlay]}: refined</b>
                <button type="button" class="button" onClick={() => app.view.change({ overlay: 'none' })}>
                    Hide
                </button>
            </header>
            {server?.overlayMap ? (
                <>
                    <div class="legend-ramp" aria-hidden="true" />
                    <p>
                        <span>not refined</span>
                        <span>more often</span>
                    </p>
                </>
            ) : (
                <p>
                    {effect && !effect.on
                        ? 'Nothing to refine: the effect is off.'
                        : `${server?.method ?? 'This method'} makes no such map. Methods that sample adaptively do, like ais.`}
                </p>
            )}
        </aside>
    );
}
