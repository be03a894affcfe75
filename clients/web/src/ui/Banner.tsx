import { useSignal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { useApp } from './context';

/** Says over the picture what is wrong with the connection, or why there is nothing to see; nothing when all is well. */
export function Banner() {
    const state = useApp().connection.value;
    if (state.at === 'online') return <EmptyPicture />;
    if (state.at === 'refused') return <TokenForm reason={state.reason} />;
    if (state.at === 'connecting') return <div class="banner">Connecting…</div>;
    return <Waiting retryAt={state.retryAt} reason={state.reason} />;
}

const EMPTY = {
    nothing: ['Nothing in view', ''],
    dark: ['No light comes from what is in view', 'switch a lamp on, or '],
} as const;

/** A camera that left the room, or a room without light. */
function EmptyPicture() {
    const app = useApp();
    const inView = app.meter.server.value?.inView ?? 'scene';
    if (inView === 'scene' || app.view.pending.value) return null;
    const [what, remedy] = EMPTY[inView];
    return (
        <div class="banner banner-empty" role="status">
            <span>
                <b>{what}:</b> {remedy}press <kbd>H</kbd> for the scene’s camera
            </span>
            <button type="button" class="button" onClick={() => app.goHome()}>
                Go there
            </button>
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
