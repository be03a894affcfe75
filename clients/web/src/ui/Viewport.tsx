import { useEffect, useRef } from 'preact/hooks';
import { number, toError } from '../lib/format';
import { length, sub } from '../lib/vec';
import { Navigation } from '../view/navigation';
import { Banner } from './Banner';
import { NOT_TO_MEASURE } from '../state/role';
import { useApp } from './context';
import { toStage } from './focus';
import { Icon } from './Icon';
import { Lazy } from './Lazy';
import { materialInWords } from './MaterialPanel';
import { Overlay } from './Overlay';
import { goTo } from './SectionNav';

const legend = () => import('./Legend').then((m) => m.Legend);
const wipePictures = () => import('./Wipe').then((m) => m.WipePictures);
const wipeLine = () => import('./Wipe').then((m) => m.WipeLine);

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
            room: () => app.surroundings.room.value,
            moveTo: (orbit) => app.view.moveTo(orbit),
            onClick: (x, y, e) => void (e.ctrlKey || e.metaKey || e.shiftKey ? app.addToSelection(x, y) : app.inspect(x, y)),
            onDoubleClick: (x, y) => void app.lookAt(x, y),
        });
        app.start(canvas.current!);
        return () => observer.disconnect();
    }, []);
    return (
        <main class="viewport">
            <div
                ref={stage}
                class={app.surroundings.room.value === null ? 'stage' : 'stage is-room'}
                tabIndex={0}
                role="application"
                onPointerMove={(e) => app.pointAt(placeIn(e))}
                onPointerLeave={() => app.pointAt(null)}
                aria-label="Rendered view. Arrow keys orbit, or look around in a room, plus and minus come closer or go away, Enter measures the light in the middle, question mark lists all keys."
            >
                <canvas ref={canvas} class={`picture ${app.comeback.isStale.value ? 'is-stale' : ''}`} />
                <Lazy when={app.compare.sides.value !== null} load={wipePictures} with={{}} />
                {app.view.settings.value.moment === null && <Overlay />}
                <span class="reticle" aria-hidden="true" />
            </div>
            <Lazy when={app.compare.sides.value !== null} load={wipeLine} with={{}} />
            <ReadingCard />
            <Lazy when={app.view.settings.value.overlay !== 'none'} load={legend} with={{}} />
            <Modes />
            <Banner />
        </main>
    );
}

function placeIn(e: PointerEvent & { currentTarget: HTMLElement }): [number, number] {
    const box = e.currentTarget.getBoundingClientRect();
    return [(e.clientX - box.left) / box.width, (e.clientY - box.top) / box.height];
}

/** What is otherwise than usual: a lamp that waits for a pick, lamps that are shown alone. */
function Modes() {
    const app = useApp();
    const aiming = app.lamps.aiming.value;
    const { solo, moment } = app.view.settings.value;
    return (
        <div class="modes">
            {aiming && (
                <p class="mode" role="status">
                    <span>
                        <b>{aiming}</b> points at what you click
                    </span>
                    <button type="button" class="button" onClick={() => (app.lamps.aiming.value = null)}>
                        Cancel
                    </button>
                </p>
            )}
            <Comparing />
            {moment !== null && (
                <p class="mode is-past" role="status">
                    <span>As it was, in your view</span>
                    <button type="button" class="button" onClick={() => (app.view.change({ moment: null }), toStage())}>
                        Now
                    </button>
                </p>
            )}
            {solo.length > 0 && (
                <p class="mode is-solo">
                    <span>
                        Only <b>{solo.length > 1 ? `${app.scene.lamps.value.filter((id) => app.isSoloed(id)).length} lamps` : solo[0]}</b>, in your view
                    </span>
                    <button type="button" class="button" onClick={() => app.toggleSolo(solo[0]!)}>
                        Show all
                    </button>
                </p>
            )}
        </div>
    );
}

function Comparing() {
    const { compare } = useApp();
    const sides = compare.sides.value;
    if (!sides) return null;
    return (
        <p class="mode is-wipe">
            <span>
                Left <b>{compare.nameOf(sides[0])}</b>, right <b>{compare.nameOf(sides[1])}</b>
            </span>
            <button type="button" class="button" aria-label="Close the comparison" onClick={() => compare.close()}>
                Close
            </button>
        </p>
    );
}

/** What was clicked, and the light that falls on it. */
function ReadingCard() {
    const app = useApp();
    const reading = app.lux.reading.value;
    if (!reading) return null;
    const { pick, carrier, lux } = reading;
    const point = app.lux.point(reading);
    const old = lux !== null && !app.lux.isCurrent.value;
    return (
        <aside class="reading" aria-label="Picked point">
            <header>
                <b>{pick.id}</b>
                <button type="button" class="icon-button" aria-label="Close" onClick={() => app.lux.hide()}>
                    <Icon name="close" />
                </button>
            </header>
            {!app.mayMeasure.value && <p class="hint">{NOT_TO_MEASURE}</p>}
            <p class={`reading-lux ${old ? 'is-old' : ''}`} aria-busy={old} hidden={!app.mayMeasure.value}>
                {lux === null ? '…' : number(toError(lux.value, lux.stderr))} <small>lx</small>
                {lux !== null && Number.isFinite(lux.stderr) && <small class="reading-error">± {number(Number(lux.stderr.toPrecision(1)))}</small>}
                {old && <small class="reading-old">{app.online.value ? 'measuring' : 'not connected'}</small>}
            </p>
            <Spoken />
            <MadeOf />
            <dl>
                <dt>Point</dt>
                <dd>{point.map((v) => v.toFixed(2)).join(', ')} m</dd>
                <dt>Distance</dt>
                <dd>{length(sub(point, app.view.shownPose.value.position)).toFixed(2)} m</dd>
            </dl>
            {lux !== null && lux.solo.length > 0 && <p class="hint">Of {lux.solo.join(', ')} alone.</p>}
            {carrier && app.mayEdit.value && <p class="hint">Drag its mark to move {carrier.id}.</p>}
        </aside>
    );
}

/** What the picked object is made of; the way to the panel that changes it. */
function MadeOf() {
    const { materials, scene } = useApp();
    const own = scene.record(materials.own.value ?? '');
    if (!own) return null;
    return (
        <button
            type="button"
            class="button reading-material"
            title="Its material, in the panel"
            onClick={() => {
                materials.choose(own.id);
                goTo('material-title');
            }}
        >
            {materialInWords(own)}
        </button>
    );
}

/** Only what is certain is said: a number that changes ten times a second drowns everything else. */
function Spoken() {
    const app = useApp();
    const lux = app.lux.reading.value?.lux;
    const text = lux && app.lux.isCurrent.value ? `${number(toError(lux.value, lux.stderr))} lux` : '';
    return (
        <span class="visually-hidden" role="status">
            {text}
        </span>
    );
}
