import { useEffect, useRef } from 'preact/hooks';
import { useApp } from './context';
import { Icon } from './Icon';
import { KEYMAP, letterKeys, POINTERS, setLetterKeys } from './keymap';

export function HelpDialog() {
    const app = useApp();
    const dialog = useRef<HTMLDialogElement>(null);
    const open = app.helpOpen.value;
    useEffect(() => {
        if (open && !dialog.current?.open) dialog.current?.showModal();
        if (!open) dialog.current?.close();
    }, [open]);
    const close = (): void => {
        app.helpOpen.value = false;
    };
    return (
        <dialog
            ref={dialog}
            class="help"
            aria-labelledby="help-title"
            onClose={close}
            closedby="any"
        >
            <div class="help-body">
                <header>
                    <h2 id="help-title">Keys and gestures</h2>
                    <button type="button" class="icon-button" aria-label="Close" onClick={close}>
                        <Icon name="close" />
                    </button>
                </header>
                <dl class="help-columns">
                    {POINTERS.map(([gesture, label]) => (
                        <Entry key={gesture} name={gesture} label={label} />
                    ))}
                    {KEYMAP.filter((k) => k.shown !== '').map((k) => (
                        <Entry key={k.label} name={k.shown} label={k.label} />
                    ))}
                </dl>
                <label class="help-option">
                    <input type="checkbox" checked={letterKeys.value} onChange={(e) => setLetterKeys(e.currentTarget.checked)} />
                    Keys of one character act everywhere. Off: only while the picture has the focus.
                </label>
            </div>
        </dialog>
    );
}

function Entry({ name, label }: { name: string; label: string }) {
    return (
        <div class="help-entry">
            <dt>
                <kbd>{name}</kbd>
            </dt>
            <dd>{label}</dd>
        </div>
    );
}
