import { OVERLAYS } from '../state/view';
import { useApp } from './context';

/** What the colours of the map over the picture mean. */
export function Legend() {
    const app = useApp();
    const { overlay } = app.view.settings.value;
    if (overlay === 'none') return null;
    const server = app.meter.server.value;
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
                        <span>once … as often as can be</span>
                    </p>
                </>
            ) : (
                <p>{server?.method} makes no such map here. Methods that sample adaptively do, like ais.</p>
            )}
        </aside>
    );
}
