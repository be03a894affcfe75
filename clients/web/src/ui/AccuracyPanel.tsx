import { duration } from '../lib/format';
import { linearScale } from '../lib/scale';
import { numberOr } from '../protocol/types';
import { expectedInWords, FRESH, knownError, opacityOf, outlookInWords, type Outlook } from '../state/convergence';
import { STOP_NAMES, STOPS, type Stop } from '../state/view';
import { useApp } from './context';
import { ErrorPlot } from './ErrorPlot';
import { Slider } from './Slider';

/** What `render.spp` is in a scene that does not say, and where a picture ends that has no such number. */
const USUAL_SPP = 1024;
const MOST_SPP = 65536;

const LAST = STOP_NAMES.length - 1;
const POSITIONS = linearScale(0, LAST, 1);
const STEP = 1 / LAST;

/** How far the picture is off, how that falls while it rests, and when it is good enough. */
export function AccuracyPanel() {
    const app = useApp();
    const method = app.method.value;
    const refines = method?.addsSamples ?? true;
    return (
        <section class="section accuracy" aria-labelledby="accuracy-title">
            <header class="section-head">
                <h2 id="accuracy-title" title="How far the picture is off in luminance from what path tracing would show in the end">
                    Accuracy
                </h2>
            </header>
            <Known predicts={refines} />
            <ErrorPlot target={refines ? drawnTarget(app.view.settings.value.stop) : null} />
            <StopSlider disabled={!refines} />
            <p class="hint" id="stop-hint">
                {refines
                    ? 'A picture at rest is refined until its error is below this with 95 % confidence; at exact, to the scene’s number of samples.'
                    : `${method?.name} makes its picture in one pass, and time makes it no more exact.`}
            </p>
        </section>
    );
}

/** Two lines always: what is below does not jump. */
function Known({ predicts }: { predicts: boolean }) {
    const app = useApp();
    const error = app.meter.server.value?.error ?? null;
    const edited = app.scene.rev.value > (app.meter.frame.value?.sceneRev ?? 0);
    const fresh = edited ? 0 : (error?.fresh ?? 1);
    return (
        <div class="known">
            <p style={{ opacity: opacityOf(fresh) }} title="Root mean square error by mean luminance; it pales while it is of the pictures before">
                {knownError(error)}
            </p>
            {error && fresh < FRESH ? <p>That is of the pictures before this one.</p> : predicts && <Prediction />}
        </div>
    );
}

/** Of the errors that the plot is about; any whole picture is fast enough. */
function drawnTarget(stop: Stop): number | null {
    return stop === 'fast' ? null : STOPS[stop];
}

function useOutlooks(): Map<Stop, Outlook> {
    const app = useApp();
    const spp = numberOr(app.scene.record('render')?.spp, USUAL_SPP) || MOST_SPP;
    return new Map(STOP_NAMES.map((stop) => [stop, app.convergence.outlook(stop, spp)]));
}

/** Of the chosen error; while none is chosen, of the next that is ahead. */
function Prediction() {
    const app = useApp();
    const outlooks = useOutlooks();
    const { stop } = app.view.settings.value;
    const ahead = STOP_NAMES.find((name) => STOPS[name] !== null && outlooks.get(name)!.is !== 'reached');
    const of = stop === 'exact' ? (ahead ?? 'exact') : stop;
    const name = of === 'fast' ? 'A first whole picture' : of === 'exact' ? 'All samples' : of;
    const { s, expected } = app.convergence.course.value;
    return (
        <p title="From the fall of the error of this picture of late, as a straight line in the plot">
            {expected && of === stop ? expectedInWords(name, expected) : outlookInWords(name, outlooks.get(of)!, s)}
        </p>
    );
}

function StopSlider({ disabled }: { disabled: boolean }) {
    const app = useApp();
    const outlooks = useOutlooks();
    const { stop } = app.view.settings.value;
    const at = STOP_NAMES.indexOf(stop);
    const error = STOPS[stop] !== null && stop !== 'fast' ? `${stop} error` : stop;
    return (
        <div class={`stops ${disabled ? 'is-disabled' : ''}`}>
            <div class="line">
                <span class="field-label">Stop refining at</span>
                <output>{error}</output>
            </div>
            <Slider
                label="Stop refining at"
                scale={POSITIONS}
                value={at}
                steps={{ arrow: STEP, page: STEP }}
                grid={STEP}
                spoken={`${error}, ${whenSpoken(outlooks.get(stop)!)}`}
                disabled={disabled}
                describedBy="stop-hint"
                onInput={(v) => STOP_NAMES[v] !== stop && app.view.change({ stop: STOP_NAMES[v]! })}
                onEnd={() => {}}
            />
            <ol aria-hidden="true">
                {STOP_NAMES.map((name) => (
                    <Position key={name} name={name} outlook={outlooks.get(name)!} chosen={name === stop} disabled={disabled} />
                ))}
            </ol>
        </div>
    );
}

/** Under the slider: what it stops at there, and when that is; upright once it is reached. The slider says it to those who do not see. */
function Position({ name, outlook, chosen, disabled }: { name: Stop; outlook: Outlook; chosen: boolean; disabled: boolean }) {
    const when = outlook.is === 'reached' || outlook.is === 'ahead' ? duration(outlook.s) : '–';
    return (
        <li class={chosen ? 'is-chosen' : ''} title={`${name}: ${whenSpoken(outlook)}`}>
            {name}
            {!disabled && <small class={outlook.is === 'reached' ? 'is-reached' : ''}>{when}</small>}
        </li>
    );
}

/** Times are those since the picture began, so that positions can be compared. */
function whenSpoken(outlook: Outlook): string {
    switch (outlook.is) {
        case 'reached':
            return `reached ${duration(outlook.s)} after the picture began`;
        case 'ahead':
            return `expected ${duration(outlook.s)} after the picture began`;
        case 'not in sight':
            return 'not in sight';
        default:
            return 'too early to tell when';
    }
}
