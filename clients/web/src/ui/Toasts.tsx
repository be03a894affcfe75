import { useApp } from './context';
import { Icon } from './Icon';

export function Toasts() {
    const { toasts } = useApp();
    return (
        <>
            <div class="toasts" role="alert">
                {toasts.shown.value.map((t) => (
                    <div key={t.key} class={`toast toast-${t.kind}`}>
                        <p>
                            {t.text}
                            {t.path && <code>{t.path}</code>}
                        </p>
                        <button type="button" class="icon-button" aria-label="Dismiss" onClick={() => toasts.dismiss(t.key)}>
                            <Icon name="close" />
                        </button>
                    </div>
                ))}
            </div>
            <div class="visually-hidden" role="status" aria-live="polite">
                {toasts.announced.value}
            </div>
        </>
    );
}
