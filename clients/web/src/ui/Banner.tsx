import { useSignal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { useApp } from './context';

/** Says what is wrong with the connection, over the picture; nothing when all is well. */
export function Banner() {
    const state = useApp().connection.value;
    if (state.at === 'online') return null;
    if (state.at === 'refused') return <TokenForm reason={state.reason} />;
    if (state.at === 'connecting') return <div class="banner">Connecting…</div>;
    return <Waiting retryAt={state.retryAt} reason={state.reason} />;
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
