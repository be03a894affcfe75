import { useSignal } from '@preact/signals';
import type { ComponentChildren } from 'preact';
import { useEffect } from 'preact/hooks';
import type { App } from '../state/app';
import { isOn } from '../state/lights';
import { projectInAddress } from '../state/projects';
import { useApp } from './context';

/** Says over the picture what is wrong with the connection, or why there is nothing to see; nothing when all is well. */
export function Banner() {
    const state = useApp().connection.value;
    if (state.at === 'online') return <EmptyPicture />;
    if (state.at === 'refused') return <TokenForm reason={state.reason} />;
    if (state.at === 'ended') return <Ended reason={state.reason} />;
    if (state.at === 'connecting') return <div class="banner">{projectInAddress() ? 'Opening…' : 'Connecting…'}</div>;
    if (state.at === 'opening') return <Opening stage={state.stage} waitedS={state.waitedS} />;
    return <Waiting retryAt={state.retryAt} reason={state.reason} />;
}

/** A large project takes its time; seconds are told once there are some. */
function Opening({ stage, waitedS }: { stage: 'opening' | 'waiting'; waitedS: number }) {
    const what = stage === 'opening' ? 'The server opens the project' : 'The server opens the project as soon as it has room for it';
    return (
        <div class="banner">
            <span role="status">{what}</span>
            <span>…{waitedS > 1 && ` ${waitedS} s`}</span>
        </div>
    );
}

interface Emptiness {
    what: string;
    /** What to do; the button does it, if one can. */
    remedy?: ComponentChildren;
    button?: [string, () => void];
}

/** What is missing, the first thing first: something to see, some light, a camera that sees them. */
function emptinessOf(app: App, inView: 'nothing' | 'dark'): Emptiness {
    const { scene, imports, uploads } = app;
    const lights = scene.lamps.value;
    const way = <>press <kbd>H</kbd> for the scene’s camera</>;
    const home: [string, () => void] = ['Go there', () => app.goHome()];
    if (inView === 'nothing' && scene.idsOfType('object').length === 0) {
        const model = uploads.offered.value
            ? 'drop a model’s file onto this page'
            : imports.offered.value
              ? 'import a model, at the end of the list'
              : 'start the server with --scene FILE or --assets FOLDER';
        if (!app.mayEdit.value) return { what: 'The scene has no objects' };
        return { what: 'The scene has no objects', remedy: `${model}, or begin with`, button: ['An empty room', () => (imports.planning.value = true)] };
    }
    if (inView === 'nothing') return { what: 'Nothing in view', remedy: way, button: home };
    if (lights.length === 0) {
        return { what: 'The scene has no light', remedy: 'drag a luminaire to where it is to hang, or', button: ['Add a lamp', () => void app.lamps.add('point')] };
    }
    if (app.view.settings.value.solo.length > 0) {
        const { solo } = app.view.settings.value;
        const what = solo.length > 1 ? `${lights.filter((id) => app.isSoloed(id)).length} lamps alone light nothing here` : `${solo[0]} alone lights nothing here`;
        return { what, button: ['Show all lamps', () => app.toggleSolo(solo[0]!)] };
    }
    if (!lights.some((id) => isOn(scene.peek(id)!))) {
        return { what: 'All lights are off', remedy: 'switch one on, in the list' };
    }
    return { what: 'No light comes from what is in view', remedy: <>switch a lamp on, or {way}</>, button: home };
}

/** A camera that left the room, a room without light, or no room at all. */
function EmptyPicture() {
    const app = useApp();
    const inView = app.meter.server.value?.inView ?? 'scene';
    if (inView === 'scene' || app.view.pending.value || app.scene.rev.value === 0) return null;
    const { what, remedy, button } = emptinessOf(app, inView);
    return (
        <div class="banner banner-empty" role="status">
            <span>
                <b>{what}</b>
                {remedy && <>: {remedy}</>}
            </span>
            {button && (
                <button type="button" class="button" onClick={button[1]}>
                    {button[0]}
                </button>
            )}
        </div>
    );
}

function Waiting({ retryAt, reason }: { retryAt: number; reason: string }) {
    const app = useApp();
    const seconds = useSignal(0);
    useEffect(() => {
        const update = (): void => {
            seconds.value = Math.max(0, Math.ceil((retryAt - performance.now()) / 1000));
        };
        update();
        const timer = setInterval(update, 250);
        return () => clearInterval(timer);
    }, [retryAt]);
    return (
        <div class="banner banner-lost">
            <span>
                <b>Not connected:</b> {reason}. Trying again{seconds.value > 0 ? ` in ${seconds.value} s` : ' …'}
            </span>
            <button type="button" class="button" onClick={() => app.retryNow()}>
                Now
            </button>
        </div>
    );
}

function Ended({ reason }: { reason: string }) {
    const app = useApp();
    return (
        <div class="banner banner-lost" role="status">
            <span>
                <b>Not connected:</b> {reason}.
            </span>
            <button type="button" class="button" onClick={() => app.retryNow()}>
                Come back
            </button>
        </div>
    );
}

function TokenForm({ reason }: { reason: string }) {
    const app = useApp();
    const token = useSignal('');
    return (
        <form
            class="banner banner-token"
            onSubmit={(e) => {
                e.preventDefault();
                if (token.value.trim()) app.useToken(token.value.trim());
            }}
        >
            <h2>Access token</h2>
            <p>{reason}</p>
            <p class="hint">It is in the address that the server printed when it started, after #t=.</p>
            <div class="import">
                <input
                    type="password"
                    autocomplete="off"
                    aria-label="Access token"
                    value={token.value}
                    onInput={(e) => (token.value = e.currentTarget.value)}
                />
                <button type="submit" class="button button-primary">
                    Connect
                </button>
            </div>
        </form>
    );
}
