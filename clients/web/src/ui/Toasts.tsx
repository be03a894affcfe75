import type { Toast } from '../state/toasts';
import { useApp } from './context';
import { Icon } from './Icon';

export function Toasts() {
    const { toasts } = useApp();
    return (
        <>
            <div class="toasts" role="alert">
                {toasts.shown.value.map((t) => (
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
        <div class={`toast toast-${toast.kind}`}>
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
