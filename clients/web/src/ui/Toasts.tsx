import { useEffect } from 'preact/hooks';
import type { Toast } from '../state/toasts';
import { useApp } from './context';
import { Icon } from './Icon';

export function Toasts() {
    const { toasts } = useApp();
    const shown = toasts.shown.value;
    // What was pointed at may be gone before the pointer leaves it.
    useEffect(() => {
        if (shown.length === 0) toasts.release();
    }, [shown.length]);
    return (
        <>
            <div
                class="toasts"
                role="region"
                aria-label="Messages"
                onMouseEnter={() => toasts.hold()}
                onMouseLeave={() => toasts.release()}
                onFocusIn={() => toasts.hold()}
                onFocusOut={() => toasts.release()}
            >
                {shown.map((t) => (
                    <Message key={t.key} toast={t} />
                ))}
            </div>
            <div class="visually-hidden" role="status" aria-live="polite">
                {toasts.announced.value}
            </div>
        </>
    );
}

function Message({ toast }: { toast: Toast }) {
    const { toasts } = useApp();
    return (
        <div class={`toast toast-${toast.kind}`} role={toast.kind === 'error' ? 'alert' : undefined}>
            <div class="toast-body">
                <p>{toast.text}</p>
                {toast.actions.length > 0 && (
                    <div class="toast-actions">
                        {toast.actions.map((a) => (
                            <button
                                key={a.label}
                                type="button"
                                class="button"
                                onClick={() => {
                                    toasts.dismiss(toast.key);
                                    a.run();
                                }}
                            >
                                {a.label}
                            </button>
                        ))}
                    </div>
                )}
            </div>
            <button type="button" class="icon-button" aria-label="Dismiss" onClick={() => toasts.dismiss(toast.key)}>
                <Icon name="close" />
            </button>
        </div>
    );
}
