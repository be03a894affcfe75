import { useEffect, useRef } from 'preact/hooks';
import { number, toError } from '../lib/format';
import { length, sub } from '../lib/vec';
import { Navigation } from '../view/navigation';
import { Banner } from './Banner';
import { useApp } from './context';
import { Icon } from './Icon';
import { Legend } from './Legend';
import { Overlay } from './Overlay';

/** A window being resized asks for a new picture only when it rests: the server starts anew for every size. */
const RESIZE_REST_MS = 150;

export function Viewport() {
    const app = useApp();
    const stage = useRef<HTMLDivElement>(null);
    const canvas = useRef<HTMLCanvasElement>(null);
    useEffect(() => {
        const element = stage.current!;
        const fit = (): void => app.view.resize(element.clientWidth, element.clientHeight, window.devicePixelRatio);
        let timer = 0;
        const observer = new ResizeObserver(() => {
            clearTimeout(timer);
            timer = setTimeout(fit, RESIZE_REST_MS) as unknown as number;
        });
        fit();
        observer.observe(element);
        new Navigation(element, {
            orbit: () => app.view.orbit.value,
            moveTo: (orbit) => app.view.moveTo(orbit),
            onClick: (x, y) => void app.inspect(x, y),
            onDoubleClick: (x, y) => void app.lookAt(x, y),
        });
        app.start(canvas.current!);
        return () => observer.disconnect();
    }, []);
    return (
        <main class="viewport">
            <div
                ref={stage}
                class="stage"
                tabIndex={0}
                role="application"
                aria-label="Rendered view. Arrow keys orbit, plus and minus zoom, question mark lists all keys."
            >
                <canvas ref={canvas} class="picture" />
                <Overlay />
            </div>
            <ReadingCard />
            <Legend />
            <Banner />
        </main>
    );
}

/** What was clicked, and the light that falls on it. */
function ReadingCard() {
    const app = useApp();
    const reading = app.reading.value;
    if (!reading) return null;
    const { pick, carrier, lux } = reading;
    const point = app.pickedPoint(reading);
    return (
        <aside class="reading" aria-label="Picked point">
            <header>
                <b>{pick.id}</b>
                <button type="button" class="icon-button" aria-label="Close" onClick={() => (app.reading.value = null)}>
                    <Icon name="close" />
                </button>
            </header>
            <p class="reading-lux" aria-live="polite">
                {lux === null ? '…' : number(toError(lux.value, lux.stderr))} <small>lx</small>
                {lux !== null && Number.isFinite(lux.stderr) && <small class="reading-error">± {number(Number(lux.stderr.toPrecision(1)))}</small>}
            </p>
            <dl>
                <dt>Point</dt>
                <dd>{point.map((v) => v.toFixed(2)).join(', ')} m</dd>
                <dt>Distance</dt>
                <dd>{length(sub(point, app.view.shownPose.value.position)).toFixed(2)} m</dd>
            </dl>
            {carrier && <p class="hint">Drag its mark to move {carrier.id}.</p>}
        </aside>
    );
}
